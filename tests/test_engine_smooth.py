"""A free-form law as smooth as its data ask: the prior, its weight, and what it does to a curve."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion
from scipy.stats import multivariate_normal

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape, bending, law_errors, law_values
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import covariance
from corexy_fmi.engine.naming.smooth import _log_evidence, smoothed
from corexy_fmi.machine import FreeForm

UNEVEN = tuple(np.sort(np.r_[0.0, np.random.default_rng(0).uniform(size=400), 1.0]))


@pytest.mark.parametrize(("power", "integral"), [(0, 0.0), (1, 0.0), (2, 4.0), (3, 12.0)])
def test_bending_is_the_integral_of_the_squared_second_derivative(power, integral):
    bent = bending(LawShape("x", "x", UNEVEN, 1.0)) @ np.array(UNEVEN) ** power
    assert bent @ bent == pytest.approx(integral, rel=0.02, abs=1e-9)


@pytest.mark.parametrize("knots", [(-1.0, -0.4, -0.1, 0.1, 0.4, 1.0), (-1.0, -0.3, 0.0, 0.3, 1.0)])
@pytest.mark.parametrize(("parity", "sign"), [("odd", -1.0), ("even", 1.0)])
def test_a_half_bends_as_the_whole_does(knots, parity, sign):
    half = LawShape("x", "vx", knots, 1.0, parity)
    own = np.arange(1.0, 1.0 + len(half.own)) ** 2
    whole = np.zeros(len(knots))
    whole[half.own] = own
    mirrored = [len(knots) - 1 - k for k in half.own]
    whole[mirrored] = np.where(np.array(mirrored) == half.own, own, sign * own)
    assert bending(half) @ own == pytest.approx(bending(replace(half, parity="")) @ whole)


def test_the_evidence_is_that_of_the_gaussian_it_stands_for():
    """Of y = A v + noise under v ~ N(0, (free + price)^-1), up to what no price changes."""
    random = np.random.default_rng(1)
    a, y, free = random.normal(size=(7, 3)), random.normal(size=7), 0.1 * np.eye(3)
    half = random.normal(size=(2, 3))
    prices = [0.3 * half.T @ half, 20.0 * half.T @ half]
    known = a.T @ a + free
    values = np.linalg.solve(known, a.T @ y)
    direct = [
        multivariate_normal.logpdf(y, cov=np.eye(7) + a @ np.linalg.inv(free + p) @ a.T)
        for p in prices
    ]
    ours = [_log_evidence(known, free, p, values) for p in prices]
    assert ours[1] - ours[0] == pytest.approx(direct[1] - direct[0], rel=1e-9)


def unseen(knots, values) -> np.ndarray:
    """Values without their straight part and jump at zero, which are also nominal friction's."""
    known = np.column_stack([np.ones(len(knots)), knots, np.sign(knots)])
    return values - known @ np.linalg.lstsq(known, values, rcond=None)[0]


def law_fit(argument: str, force, knots, seed: int) -> Fit:
    """A fit of a law with few knots to a recording in which a force acts along x."""
    many = np.linspace(knots[0], knots[-1], 24)
    form = FreeForm("x", argument, tuple(many.tolist()), tuple(force(many).tolist()))
    run = record(replace(machine(), free_forms=(form,)), rich_motion(), seed=seed)
    return fitted(
        replace(
            problem(run, machine()),
            hypothesis=Hypothesis(law=LawShape("x", argument, tuple(knots), 0.1)),
        )
    )


def off(fit: Fit, force, at) -> float:
    """Rms of a fit's law minus a force, but for what retuning holds, over that of the force."""
    told = np.interp(at, fit.problem.hypothesis.law.knots, law_values(fit))
    truth = unseen(at, force(at))
    return float(np.linalg.norm(unseen(at, told) - truth) / np.linalg.norm(truth))


def drag(speed):
    return -40.0 * speed * np.abs(speed)


def bump(place):
    return 0.4 * np.exp(-(((place - 0.006) / 0.004) ** 2))


@pytest.mark.parametrize(
    ("argument", "force", "knots"),
    [
        ("vx", drag, 0.1 * np.array([-1.0, -0.4, -0.14, -0.05, 0.05, 0.14, 0.4, 1.0])),
        ("x", bump, np.linspace(-0.02, 0.03, 9)),
    ],
)
def test_a_smooth_law_is_nearer_to_what_acts(argument, force, knots):
    few = law_fit(argument, force, knots, seed=1)
    told = smoothed(few)
    law = told.problem.hypothesis.law
    assert len(law.knots) > len(knots)
    assert law.stiffness > 0
    at = np.linspace(0.9 * knots[0], 0.9 * knots[-1], 200)
    assert off(told, force, at) < 0.7 * off(few, force, at)
    spread = law_errors(told, covariance(told))
    assert (spread > 0).all()


def test_a_fit_without_a_law_stays_as_it_is():
    fit = fitted(problem(record(machine(), rich_motion()), machine()), 2)
    assert smoothed(fit) is fit
