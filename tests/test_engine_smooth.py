"""A free-form law as smooth as its data ask: the prior, its weight, and what it does to a curve."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import fitted, machine, pair, problem, record, rich_motion
from scipy.stats import multivariate_normal

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import (
    WIDE,
    LawShape,
    bending,
    law_errors,
    law_places,
    law_values,
)
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import covariance, tuned_machine
from corexy_fmi.engine.naming.smooth import along_both, log_evidence, smoothed
from corexy_fmi.machine import FreeForm
from corexy_fmi.motion import Motion, chain, line, rest

ODD = LawShape("x", "vx", (-0.1, -0.04, -0.014, -0.005, 0.005, 0.014, 0.04, 0.1), 0.1, parity="odd")
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
    """Of y = A v + B w + noise under v ~ N(0, (root' root)^-1), but for what no root changes."""
    random = np.random.default_rng(1)
    a, b, y = random.normal(size=(9, 3)), random.normal(size=(9, 2)), random.normal(size=9)
    rest = np.diag([0.7, 1.3])
    told, direct = [], []
    for weight in (0.3, 20.0):
        own = np.linalg.qr(np.vstack([0.3 * np.eye(3), weight * random.normal(size=(2, 3))]))[1]
        root = np.block([[own, np.zeros((3, 2))], [np.zeros((2, 3)), rest]])
        rows = np.vstack([np.hstack([a, b]), root])
        asked = np.r_[y, np.zeros(5)]
        u = np.linalg.lstsq(rows, asked)[0]
        unknowns = [SimpleNamespace(key=f"free_form.x.values[{k}]") for k in range(3)]
        unknowns += [SimpleNamespace(key="carriage_mass")] * 2
        hypothesis = SimpleNamespace(laws=(SimpleNamespace(location="x"),))
        fit = SimpleNamespace(
            problem=SimpleNamespace(hypothesis=hypothesis, unknowns=unknowns, root=root),
            cost=0.5 * np.sum((asked - rows @ u) ** 2),
            jacobian=rows,
        )
        told.append(log_evidence(fit))
        seen = a @ np.linalg.inv(own.T @ own) @ a.T + b @ np.linalg.inv(rest.T @ rest) @ b.T
        direct.append(multivariate_normal.logpdf(y, cov=np.eye(9) + seen))
    assert told[1] - told[0] == pytest.approx(direct[1] - direct[0], rel=1e-9)


@pytest.mark.parametrize("stiffness", [1e-3, 1.0, 1e13])
def test_a_stiff_law_has_the_prior_that_it_says(stiffness):
    law = LawShape("x", "vx", (-0.1, -0.02, -0.003, 0.003, 0.02, 0.1), 0.1, stiffness=stiffness)
    run = record(machine(), rich_motion())
    asked = replace(problem(run, machine()), hypothesis=Hypothesis(law=law))
    at = law_places(asked.unknowns, law)
    u, values = np.zeros(asked.size), np.array([0.3, -0.1, 0.4, 0.2, 0.0, 0.5])
    u[at] = values
    told = np.sum(asked.residual(u[None])[0, -asked.size :] ** 2)
    wanted = np.sum(values**2) / WIDE**2 + stiffness * np.sum((bending(law) @ values) ** 2)
    assert told == pytest.approx(wanted, rel=1e-9)


def unseen(knots, values) -> np.ndarray:
    """Values without their straight part and jump at zero, which are also nominal friction's."""
    known = np.column_stack([np.ones(len(knots)), knots, np.sign(knots)])
    return values - known @ np.linalg.lstsq(known, values, rcond=None)[0]


def law_fit(argument: str, force, knots, seed: int, motion: Motion | None = None) -> Fit:
    """A fit of a law with few knots to a recording in which a force acts along x."""
    far = 3 * knots[-1] if motion else knots[-1]
    many = np.linspace(-far if motion else knots[0], far, 24)
    form = FreeForm("x", argument, tuple(many.tolist()), tuple(force(many).tolist()))
    run = record(replace(machine(), free_forms=(form,)), motion or rich_motion(), seed=seed)
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


def strong(speed):
    return 5.0 * drag(speed)


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


def test_a_law_over_speed_reaches_to_the_fastest():
    """A drag shows most where a motion is for moments only."""
    corners = ((0.0, 0.0), (0.03, 0.0), (-0.02, 0.0), (0.0, 0.0), (-0.02, 0.0), (0.03, 0.0))
    speeds = (0.02, 0.04, 0.12, 0.12, 0.03)
    moves = [line(a, b, v, 4.0) for (a, b), v in zip(pairwise(corners), speeds, strict=True)]
    knots = 0.042 * np.array([-1.0, -0.4, -0.14, -0.05, 0.05, 0.14, 0.4, 1.0])
    few = law_fit("vx", strong, knots, seed=1, motion=chain(rest((0, 0), 0.1), *moves))
    told = smoothed(few)
    fastest = np.abs(few.problem.simulate(few.u[None], 0, ("vx",))[0]).max()
    reach = told.problem.hypothesis.law.knots
    assert (-reach[0], reach[-1]) == pytest.approx((fastest, fastest), rel=0.02)
    at = np.linspace(-fastest, fastest, 200)
    assert off(told, strong, at) < 0.6 * off(few, strong, at)


@pytest.mark.parametrize("acts_on_y", [True, False])
def test_a_law_acts_along_both_axes_where_that_pays(acts_on_y):
    many = np.linspace(-0.1, 0.1, 24)
    axes = ("x", "y") if acts_on_y else ("x",)
    forms = tuple(
        FreeForm(axis, f"v{axis}", tuple(many.tolist()), tuple(drag(many).tolist()))
        for axis in axes
    )
    run = record(replace(machine(), free_forms=forms), rich_motion(), seed=3)
    one = fitted(replace(problem(run, machine()), hypothesis=Hypothesis(law=ODD)))
    found = along_both(one)
    if not acts_on_y:
        assert found is one
        return
    assert found.cost < one.cost - 50.0
    told = smoothed(found)
    hypothesis = told.problem.hypothesis
    assert hypothesis.key == (("free_form", "x"), ("free_form", "y"))
    assert hypothesis.places[0] == "xy"
    assert [law.argument for law in hypothesis.laws] == ["vx", "vy"]
    at = np.linspace(-0.09, 0.09, 200)
    for law, kept in zip(hypothesis.laws, tuned_machine(told, "told").free_forms, strict=True):
        assert kept.location == law.location
        near = unseen(at, np.interp(at, kept.knots, kept.values)) - unseen(at, drag(at))
        assert np.linalg.norm(near) < 0.3 * np.linalg.norm(unseen(at, drag(at)))
        assert (law_errors(told, covariance(told), law)[law.own] > 0).all()


def waves(place):
    return 0.25 * np.sin(2 * np.pi * place / 0.03) * np.exp(-((place / 0.02) ** 2))


@pytest.mark.long
def test_a_diagnosis_tells_what_is_missing_along_both_axes():
    many = np.linspace(-0.03, 0.04, 24)
    known = (tuple(many.tolist()), tuple(waves(many).tolist()))
    forms = tuple(FreeForm(axis, axis, *known) for axis in "xy")
    found = diagnose(*pair(replace(machine(), free_forms=forms)), machine(), jobs=2)
    document = found.document
    assert document["verdict"] == "unexplained"
    told = {e["location"]: e for e in document["effects"]}
    assert {e["name"] for e in document["effects"]} == {"free_form"}
    assert set(told) == {"x", "y"}
    assert document["located"]["coordinate"] == "xy"
    assert document["heldout"]["excess_removed"] > 0.9
    for axis, effect in told.items():
        assert effect["argument"] == axis
        assert f"depends on {axis}" in effect["description"]
    assert {law.location for law in found.machine.free_forms} == {"x", "y"}
    assert {law.coordinate for law in found.evidence.laws} == {"x", "y"}


def test_a_fit_without_a_law_stays_as_it_is():
    fit = fitted(problem(record(machine(), rich_motion()), machine()), 2)
    assert smoothed(fit) is fit
