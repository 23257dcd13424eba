"""The curves that a report draws are those that were judged."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, problem, record, short_motion, with_effects

from corexy_fmi.engine.data.samples import split_in_time
from corexy_fmi.engine.judging.prove import follow_up
from corexy_fmi.engine.judging.prove import replay as replay_of
from corexy_fmi.engine.telling.exhibit import curves
from corexy_fmi.machine import EffectUse

PULL = EffectUse("constant_force", "y", {"force": 5.0})


def replayed(**metadata: str):
    recording = record(with_effects(machine("light_bench"), PULL), short_motion())
    recording = replace(recording, metadata=recording.metadata | metadata)
    chosen = problem(recording, machine("light_bench"))
    return replay_of(chosen.layout, chosen.machine, chosen.runs[0], chosen.noise[0])


def apart(found) -> list:
    shown = curves(found)
    return [s.value - shown[s.channel][s.index] for s in found.run.samples]


@pytest.mark.parametrize("metadata", [{}, {"zero": "x, y"}, {"clock": "free"}], ids=str)
def test_what_is_drawn_is_off_by_what_was_judged(metadata):
    found = replayed(**metadata)
    for drawn, judged in zip(apart(found), found.errors, strict=True):
        np.testing.assert_allclose(drawn, judged, atol=1e-15)


def test_a_pull_shows_where_a_zero_is_known():
    _, hidden = apart(replayed())
    _, shown = apart(replayed(zero="x, y"))
    assert abs(hidden.mean()) < 1e-12
    assert abs(shown.mean()) > 5e-6


def test_a_last_part_is_drawn_with_the_offset_of_the_first():
    chosen = machine("light_bench")
    recording = record(chosen, short_motion())
    drifts = np.linspace(0.0, 4e-4, len(recording))
    channels = recording.channels | {"x": recording["x"] + drifts}
    first, last = split_in_time(replace(recording, channels=channels), chosen, 0.05)
    noise = problem(recording, chosen).noise[0]
    found = follow_up(problem(recording, chosen).layout, chosen, last, noise, first)
    off, _ = apart(found)
    assert off.mean() > 1e-4
    np.testing.assert_allclose(off, found.errors[0], atol=1e-15)
