"""Pulses whose fit ended with too long ones are found again at their places and of their width."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, other_motion, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import Fit, costs, minimise
from corexy_fmi.engine.naming.matched import matched
from corexy_fmi.machine import EffectUse

PULSES, HEAD = ("periodic_disturbance", "x"), "periodic_disturbance.x."
TRAIN = {"amplitude": 0.3, "frequency": 9.7, "duty": 0.15}
PHASES = {"phase@0.csv": 0.4, "phase@1.csv": -2.0}
LATE = {"amplitude": 0.15, "duty": 0.4, "phase@1.csv": -3.1}


@pytest.fixture(scope="module")
def chosen():
    bare, runs = machine(), []
    for n, motion in enumerate([rich_motion(), other_motion()]):
        phase = PHASES[f"phase@{n}.csv"]
        truth = with_effects(bare, EffectUse(*PULSES, TRAIN | {"phase": phase}))
        shown = record(truth, motion, f"{n}.csv", seed=n, noise=1e-5)
        runs += problem(shown, bare, [PULSES], 1e-5).runs
    first = problem(shown, bare, [PULSES], 1e-5)
    own = replace(first, runs=tuple(runs), noise=first.noise * len(runs))
    return replace(own, hypothesis=replace(own.hypothesis, shaped=True))


def standing(chosen, values):
    """Internal vector with the pulses' parameters set, all others as the machine file has them."""
    known = TRAIN | PHASES | values
    u = np.zeros(chosen.size)
    for k, unknown in enumerate(chosen.unknowns):
        if unknown.key.startswith(HEAD):
            u[k] = unknown.internal(known[unknown.key.removeprefix(HEAD)])
    return u


def test_late_and_long_pulses_are_begun_again_where_they_are(chosen):
    best = minimise(chosen, standing(chosen, {}), 10)
    stuck = minimise(chosen, standing(chosen, LATE), 3)
    assert stuck.cost > best.cost + 20
    found = matched(stuck, map)
    assert found.cost == pytest.approx(best.cost, abs=1.0)
    for name in ("amplitude", "duty", *PHASES):
        assert found.value(HEAD + name) == pytest.approx(best.value(HEAD + name), rel=0.02)


def test_a_fit_that_stands_best_stays(chosen):
    best = minimise(chosen, standing(chosen, {}), 10)
    assert matched(best, map) is best


def test_pulses_of_no_size_are_no_trouble(chosen):
    """They change nothing wherever they are."""
    u = standing(chosen, {"amplitude": 0.0})
    residual = chosen.residual(u[None])[0]
    still = Fit(chosen, u, float(costs(residual[None])[0]) + chosen.log_scale(), residual)
    assert np.isfinite(matched(still, map).cost)
