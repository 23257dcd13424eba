"""Intervals where a machine file is off in the direction of the effect itself."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.looser import LOOSE, loosened
from corexy_fmi.engine.judging.model import covariance, effect_table, ends
from corexy_fmi.machine import EffectUse

LATE = EffectUse("sensor_delay", "sensor", {"delay": 2e-3})
RESEMBLING = {
    "carriage_viscous_friction": 0.6,
    "bridge_viscous_friction": 0.6,
    "belt_axial_stiffness": 1.3,
}  # less viscous lag in stiffer belts: two deviations of the file, all of which hide a delay
NOISE = 1e-4


def delayed(**off: float):
    """The fit of a delay to a recording of a machine that is off from its file."""
    truth = with_effects(machine(), LATE, **off)
    shown = record(truth, rich_motion(), noise=NOISE)
    return fitted(problem(shown, machine(), [("sensor_delay", "sensor")], std=NOISE), 30)


def test_an_interval_holds_the_truth_that_the_file_speaks_against():
    fit = delayed(**RESEMBLING)
    loose = loosened(fit)
    told, wide = (
        effect_table(fit, "sensor_delay", "sensor", covariance(fit), other)["delay"]
        for other in ([], [ends(loose)])
    )
    assert told["ci95"][1] < LATE.parameters["delay"] < wide["ci95"][1]
    assert told["value"] == wide["value"]
    assert wide["ci95"][0] <= told["ci95"][0]


def test_what_the_data_decide_keeps_its_interval():
    """On quiet data priors tell nothing, loose or not."""
    truth = with_effects(machine(), LATE)
    shown = record(truth, rich_motion(), noise=1e-6)
    fit = fitted(problem(shown, machine(), [("sensor_delay", "sensor")], std=1e-6), 30)
    told, wide = (
        effect_table(fit, "sensor_delay", "sensor", covariance(fit), other)["delay"]["ci95"]
        for other in ([], [ends(loosened(fit))])
    )
    assert np.ptp(wide) == pytest.approx(np.ptp(told), rel=0.1)


def test_priors_are_looser_and_nothing_else_is():
    fit = delayed()
    loose = loosened(fit)
    n = fit.problem.nominal_count
    ratio = np.array([y.prior_std / x.prior_std for x, y in zip(
        fit.problem.unknowns[:n], loose.problem.unknowns[:n], strict=True)])  # fmt: skip
    assert set(np.round(ratio, 9)) == {1.0, LOOSE}  # how sgn is rounded is no matter of the file
    assert loose.problem.noise == fit.problem.noise
    assert loose.problem.keys == fit.problem.keys


def test_without_an_effect_nothing_is_loosened():
    shown = record(machine(), rich_motion())
    assert loosened(fitted(problem(shown, machine()), 1)) is None


def test_a_fit_that_broke_down_is_left_out():
    fit = delayed()
    broken = replace(fit, u=np.full_like(fit.u, np.nan))
    assert loosened(broken) is None
