"""What a diagnosis may not look for, from what the recordings are."""

from dataclasses import replace

import pytest
from engine_kit import machine, record, short_motion

from corexy_fmi.engine.given import make_runs, meaningless
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
