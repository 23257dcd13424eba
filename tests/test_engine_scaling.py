"""A common factor of all masses, forces and stiffnesses: no motion tells it, priors alone do."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.scaling import agree, eased, grown
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import covariance
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

FORCE = EffectUse("constant_force", "x", {"force": 0.4})
MACHINES = pytest.mark.parametrize("name", ["yin2018", "yin2018_dc", "gt2_printer"])


def posed(name):
    """A recording with a constant force beside, that force to be found."""
    chosen = problem(record(with_effects(machine(name), FORCE), rich_motion()), machine(name))
    return replace(chosen, hypothesis=Hypothesis((bundled_layout().find("constant_force", "x"),)))


@MACHINES
def test_a_common_factor_changes_no_motion(name):
    chosen, u = posed(name), np.zeros(posed(name).size)
    u[chosen.keys.index("constant_force.x.force")] = 1.0
    other = grown(chosen.unknowns, u, 0.3)
    count = sum(run.count for run in chosen.runs)
    white = chosen.residual(np.array([u, other]))[:, :count]
    assert np.abs(other - u).max() > 0.3
    assert np.abs(white[1] - white[0]).max() < 1e-5
    assert np.abs(white[0]).max() > 3.0


@MACHINES
def test_the_jacobian_tells_nothing_of_it(name):
    """Its variance is what the priors leave, and no less."""
    fit = settle(minimise(posed(name), np.zeros(posed(name).size)))
    unknowns, precision = fit.problem.unknowns, fit.problem.prior[1]
    move = (grown(unknowns, fit.u, 1e-6) - fit.u) / 1e-6
    weight = move * precision**2
    told = weight @ covariance(fit) @ weight  # of the factor as the priors would weigh it
    assert told == pytest.approx(float(np.sum(move**2 * precision**2)), rel=0.1)


@MACHINES
def test_a_fit_takes_the_factor_that_its_priors_like_best(name):
    chosen = posed(name)
    start = grown(chosen.unknowns, np.zeros(chosen.size), 0.25)
    fit = minimise(chosen, start, 25)
    precision = chosen.prior[1]
    move = grown(chosen.unknowns, fit.u, 1e-6) - fit.u
    pulled = np.sum(move * fit.u * precision**2) / np.sum((move * precision) ** 2) * 1e-6
    assert abs(pulled) < 0.02


def test_what_is_known_in_newtons_fixes_the_factor():
    """A mass that the machine file holds: the factor is seen, and no trial is eased."""
    known = machine("yin2018")
    known = replace(known, rel_std=known.rel_std | {"carriage_mass": 0.0})
    chosen = problem(record(known, rich_motion()), known)
    fit = settle(minimise(chosen, np.zeros(chosen.size)))
    assert not fit.problem.scale_unseen(fit.u, fit.jacobian)


def test_slopes_are_corrected_in_proportion_to_their_power():
    before, move = np.array([[2.0, 0.0], [1.0, 0.0]]), np.array([1.0, 1.0])  # (size, samples)
    slopes = before.copy()
    agree(slopes, move, np.array([0.5, 1.0]))
    assert move @ slopes == pytest.approx([0.5, 1.0])
    assert (slopes - before)[:, 0] == pytest.approx([-2.0, -0.5])
    nothing = 0 * before
    agree(nothing, move, np.ones(2))
    assert not nothing.any()
    agree(slopes, move, np.array([np.inf, 1.0]))
    assert np.isfinite(slopes).all()


def test_easing_keeps_what_is_no_force():
    chosen = posed("yin2018")
    u = 0.1 * np.ones(chosen.size)
    found = eased(chosen.unknowns, u, chosen.prior[1])
    same = [k for k, x in enumerate(chosen.unknowns) if not x.force]
    assert same
    assert np.array_equal(found[same], u[same])
    assert np.sum(found * chosen.prior[1]) < np.sum(u * chosen.prior[1])
