"""An encoder's counts: what of them is told twice."""

import numpy as np
import pytest
from engine_kit import machine, record, short_motion

from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.data.steps import sensor_step, told_before
from corexy_fmi.engine.fitting.noise import finest

COUNT = 2 * np.pi / 4000  # [rad]


def test_of_each_stretch_of_one_count_the_middle_stays():
    counts = np.array([5, 5, 5, 5, 5, 6, 7, 7, 7, 6, 6])
    kept = np.flatnonzero(~told_before(COUNT * counts))
    assert kept.tolist() == [2, 5, 7, 9]


def test_values_that_are_no_counts_all_stay():
    random = np.random.default_rng(0)
    for values in (random.standard_normal(50), np.zeros(50), np.repeat(random.uniform(size=9), 5)):
        assert not told_before(values).any()


@pytest.mark.parametrize("speed", [0.2, 1.0, 30.0])
def test_in_even_motion_rounding_is_never_more_in_the_middle_of_a_count(speed):
    """Slow: 1 / 5 of a count a row; fast: 20 of them, where every sample is new."""
    angle = speed * COUNT * (np.arange(4000) + 0.37)
    seen = COUNT * np.round(angle / COUNT)
    kept = ~told_before(seen)
    assert np.std((seen - angle)[kept]) <= np.std(seen - angle) * 1.001
    assert kept.sum() == pytest.approx(len(angle) * min(speed, 1.0), rel=0.01)


@pytest.mark.parametrize("rounded", [True, False])
def test_a_rest_is_one_sample_of_an_encoder(rounded):
    dc = machine("yin2018_dc")
    shown = record(dc, short_motion(), noise=1e-5, channels=("x", "phi1_meas", "phi2_meas"))
    values = shown.channels["phi1_meas"]
    if rounded:
        shown.channels["phi1_meas"] = COUNT * np.round(values / COUNT)
    run = make_run(shown, dc, "train")
    counted = {s.channel: len(s.index) for s in run.samples}
    assert counted["x"] == counted["phi2_meas"] == len(shown.time)
    assert (counted["phi1_meas"] < 0.9 * counted["x"]) == rounded
    assert (sensor_step(shown.channels["phi1_meas"]) > 0) == rounded


def test_of_an_encoder_less_than_a_count_is_noise():
    """Rounding repeats itself for as long as rows are whole counts apart: it is no noise."""
    dc = machine("yin2018_dc")
    shown = record(dc, short_motion(), noise=0.0, channels=("x", "phi1_meas", "phi2_meas"))
    shown.channels["phi1_meas"] = COUNT * np.round(shown.channels["phi1_meas"] / COUNT)
    least = {s.channel: finest(s) for s in make_run(shown, dc, "train").samples}
    assert least["phi1_meas"] == pytest.approx(COUNT)
    assert least["phi2_meas"] < 1e-3 * COUNT
