"""A sensor whose clock nobody tied to the inputs': its offset is no cause."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.fitting.clock import start
from corexy_fmi.engine.fitting.parametrisation import LATE
from corexy_fmi.machine import EffectUse
from tests.engine_kit import machine as nominal
from tests.engine_kit import pair, problem

OFFSETS = (0.0137, -0.0213)


def shifted(recording, offset):
    """The same recording, its samples stamped late by an offset [s], its clock declared free."""
    channels = {
        n: np.interp(recording.time - offset, recording.time, v) if n in ("x", "y") else v
        for n, v in recording.channels.items()
    }
    metadata = {**recording.metadata, "clock": "free"}
    return replace(recording, channels=channels, metadata=metadata)


@pytest.mark.parametrize("offset", OFFSETS)
def test_the_offset_is_found(offset):
    machine = nominal("light_bench")
    train, _ = pair(machine)
    posed = problem(shifted(train[0], offset), machine)
    assert LATE * start(posed)[-1] == pytest.approx(offset, abs=3e-3)


def test_a_channel_that_stands_still_tells_no_offset():
    machine = nominal("light_bench")
    train, _ = pair(machine)
    late = shifted(train[0], OFFSETS[0])
    still = replace(late, channels=late.channels | {"y": np.zeros(len(late))})
    assert LATE * start(problem(still, machine))[-1] == pytest.approx(OFFSETS[0], abs=3e-3)


@pytest.mark.long
def test_an_offset_hides_no_effect_and_is_none():
    bare = nominal("light_bench")
    for machine, expected in (
        (bare, ("nothing_missing", [])),
        (
            replace(bare, effects=(EffectUse("backlash", "motor1", {"gap": 0.03}),)),
            ("explained", [("backlash", "motor1")]),
        ),
    ):
        train, judge = ([shifted(r, o) for r, o in zip(rs, OFFSETS, strict=False)]
                        for rs in pair(machine))  # fmt: skip
        document = diagnose(train, judge, bare, jobs=2).document
        found = [(e["name"], e["location"]) for e in document["effects"]]
        assert (document["verdict"], found) == expected
        assert "sensor_delay" not in {row["name"] for row in document["not_excluded"]}
