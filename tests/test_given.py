"""What a diagnosis may not look for, from what the recordings are."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, record, short_motion

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.given import make_runs, meaningless, unjudged
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.layout import bundled_layout

SENSOR = {i.effect.name for i in bundled_layout().instances if i.location == "sensor"}


def struck(stage, channels=("x", "y"), **metadata):
    recording = record(machine(stage), short_motion(), channels=channels)
    recording = replace(recording, metadata=recording.metadata | metadata)
    runs, _ = make_runs([recording], [], machine(stage))
    return meaningless(runs, machine(stage), bundled_layout())


@pytest.mark.parametrize("stage", ["yin2018", "yin2018_dc", "light_bench"])
@pytest.mark.parametrize("zero", ["", "x, y"])
def test_a_tracker_beside_the_motors_may_have_any_fault_whatever_its_zero(stage, zero):
    assert not struck(stage, zero=zero) & SENSOR


def test_a_free_clock_leaves_no_delay_to_find():
    assert struck("yin2018", clock="free") >= {"sensor_delay"}


@pytest.mark.parametrize(("metadata", "own"), [({"zero": "x"}, True), ({}, False)])
def test_what_a_loop_runs_on_follows_its_sensor(metadata, own):
    found = struck("emps", ["x"], controller="pd kp=38995.821 kd=243.45", **metadata)
    assert (found >= SENSOR) == own
    assert bool(found & SENSOR) == own


def test_a_recording_too_short_to_keep_a_part_back_is_said_to_judge_nothing():
    long, short = (
        record(machine(), short_motion(), n, tracker=t) for n, t in (("a", 1), ("b", 30))
    )
    runs, kept = make_runs([long, short], [], machine())
    assert [r.name for r in runs] == ["a", "b"]
    assert [r.name for r in kept] == ["a"]
    (told,) = unjudged(runs, kept, [])
    assert told.text.startswith(
        "b: nothing that is fitted has more than 20 samples in the last 30 %"
    )
    assert not unjudged(runs, kept, [long])


def test_a_recording_that_only_judges_needs_samples_too():
    long, none = (record(machine(), short_motion(), n, tracker=t) for n, t in (("a", 1), ("b", 90)))
    with pytest.raises(
        InputError, match="b: no measured channel that can be fitted has more than 20 samples"
    ):
        make_runs([long], [none], machine())


def test_nothing_kept_back_is_told_and_proves_nothing():
    document = diagnose([record(machine(), short_motion(), tracker=30)], [], machine()).document
    assert document["heldout"]["rms_explained"] is None
    assert document["heldout"]["weak"]
    assert any("which judge" in f["text"] for f in document["findings"])


def test_a_recording_that_only_judges_measures_what_was_fitted():
    fitted_on = record(machine(), short_motion(), "a", channels=["x"])
    other = record(machine(), short_motion(), "b", channels=["y", "vx"])
    with pytest.raises(InputError, match="b: measures y, vx, expected some of what is fitted: x"):
        make_runs([fitted_on], [other], machine())


@pytest.mark.parametrize(("first", "last"), [(0.0, 0.6), (0.75, 1.0)])
def test_a_channel_that_only_one_part_has_does_not_judge(first, last):
    whole = record(machine(), short_motion())
    share = np.linspace(0.0, 1.0, len(whole))
    y = np.where((share >= first) & (share <= last), whole.channels["y"], np.nan)
    recording = replace(whole, channels=whole.channels | {"y": y})
    _, (late,) = make_runs([recording], [], machine())
    assert late.outputs == ("x",)
    document = diagnose([recording], [], machine()).document
    assert document["heldout"]["rms_explained"] is not None
