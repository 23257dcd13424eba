"""The micro-step of a search: as long as the noise allows; the last fits take the machine's own."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import STRIBECK, fitted, machine, problem, record, short_motion, with_effects

from corexy_fmi.engine.fitting import retune
from corexy_fmi.engine.fitting.fit import HIDDEN, Fit, costs, fine, hides
from corexy_fmi.engine.fitting.micro_step import AT_EASE, damped
from corexy_fmi.engine.fitting.slopes import BROKEN
from corexy_fmi.engine.fitting.starts import stiffened
from corexy_fmi.engine.fitting.unknowns import STIFFNESS
from corexy_fmi.engine.naming import abreast
from corexy_fmi.engine.naming.signature import changes

RIGID = ("axis_skew", "sensor"), ("constant_force", "x"), ("stribeck_friction", "x")
POLES = ("tool_mode", "tool"), ("presliding_hysteresis", "x"), ("belt_mismatch", "belts")


def posed(uses=(), noise=2e-5, **changes):
    recording = record(with_effects(machine(), STRIBECK), short_motion(), noise=noise)
    return replace(problem(recording, machine(), uses, std=noise), **changes)


@pytest.mark.parametrize("use", RIGID)
def test_what_brings_no_pole_takes_the_machines_step_times_coarse(use):
    for coarse in (1.0, 3.0):
        assert posed([use], coarse=coarse).limit == pytest.approx(coarse * posed().limit)


@pytest.mark.parametrize("use", POLES)
def test_the_step_of_a_pole_or_of_belts_is_lengthened_as_far_as_it_is_stable(use):
    one, most = (posed([use], coarse=c).limit for c in (1.0, 4.0))
    assert AT_EASE * one <= most * 1.001 <= 4.0 * posed().limit * 1.002
    chosen = posed([use], coarse=4.0)
    assert costs(chosen.residual(np.zeros((1, chosen.size))))[0] < BROKEN


def at(chosen, time):
    """u with belts damped by so many seconds."""
    u = np.zeros(chosen.size)
    k = chosen.keys.index("belt_damping.belts.time")
    u[k] = chosen.unknowns[k].internal(time)
    return u


def test_the_step_of_damped_belts_follows_their_damping():
    """Undamped it is that of the bare machine; then halved until it is stable."""
    chosen = posed([("belt_damping", "belts")], coarse=2.0)
    assert chosen.limit == posed(coarse=2.0).limit
    tried = [1e-4, 5e-3, 1e-2]
    vectors = [chosen.vectors(at(chosen, t)[None], 0) for t in tried]
    steps = [
        damped(chosen.layout, chosen.machine, v, chosen.damping, chosen.limit) for v in vectors
    ]
    assert steps[0] == chosen.limit > steps[1] > steps[2]
    for time in tried:
        rough, exact = (replace(chosen, coarse=c) for c in (2.0, 0.25))
        change = rough.residual(at(rough, time)[None]) - exact.residual(at(exact, time)[None])
        assert costs(change)[0] < HIDDEN


def test_sets_without_damping_take_the_whole_step():
    chosen = posed([("belt_damping", "belts")])
    still = chosen.vectors(np.zeros((2, chosen.size)), 0)
    assert (still[:, chosen.damping] == 0).all()
    given = chosen.layout, chosen.machine, still, chosen.damping
    assert damped(*given, chosen.limit) == chosen.limit


def test_the_most_damped_set_decides():
    chosen = posed([("belt_damping", "belts")])
    mild, strong = at(chosen, 1e-4), at(chosen, 9e-3)
    alone = chosen.residual(np.array([strong, strong]))[0]
    assert np.array_equal(chosen.residual(np.array([mild, strong]))[1], alone)


def test_the_longest_step_that_changes_next_to_nothing_is_taken():
    loud, quiet = posed(noise=1e-4), posed(noise=1e-11)
    u = np.zeros(loud.size)
    assert retune._quick(loud, u).coarse > 1
    assert retune._quick(quiet, u).coarse == 1


def test_belts_that_retuned_soft_take_no_step_that_those_of_the_machine_file_break_down_with():
    loud = posed(noise=1e-3)
    soft, file = np.zeros((2, loud.size))
    soft[loud.keys.index(STIFFNESS)] = -2.0
    chosen = retune._quick(loud, soft)
    assert hides(loud, replace(loud, coarse=4.0), soft, retune.SHOWN)
    for u in (soft, file):
        assert costs(chosen.residual(stiffened(chosen, u)[None]))[0] < BROKEN


def test_a_step_that_hides_nothing_is_refined_at_the_end():
    rough = posed(noise=1e-10, coarse=4.0)
    own = replace(rough, coarse=1.0)
    u = np.zeros(rough.size)
    assert not hides(own, rough, u)
    residual = rough.residual(u[None])[0]
    ended = fine(Fit(rough, u, float(costs(residual[None])[0]), residual))
    assert ended.problem.limit == own.limit
    assert 0.5 * float(ended.residual @ ended.residual) <= costs(own.residual(u[None]))[0]


def test_a_run_that_breaks_down_in_part_is_no_signature(monkeypatch):
    base = fitted(posed())
    samples = base.problem.parts[-1].stop
    huge = np.full((2, samples), 1e200)
    huge[0] = base.residual[:samples] + 1.0
    monkeypatch.setattr(abreast, "_answers", lambda asked: [huge])
    found = abreast.alone(changes(base, base.problem, np.zeros((2, base.problem.size))))
    assert found[0].any()
    assert not found[1].any()


def test_a_step_that_the_noise_hides_is_left():
    fit = fitted(posed(noise=1e-4, coarse=2.0))
    assert hides(fit.problem, replace(fit.problem, coarse=1.0), fit.u, HIDDEN)
    assert fine(fit) is fit


@pytest.mark.parametrize(("noise", "longer"), [(1e-4, True), (1e-11, False)])
def test_what_is_left_unnamed_is_bounded_with_the_longest_step_that_hides_it(noise, longer):
    own = posed(noise=noise)
    u = np.zeros(own.size)
    residual = own.residual(u[None])[0]
    fit = Fit(own, u, float(costs(residual[None])[0]) + own.log_scale(), residual)
    eased = retune.quick(fit)
    assert (eased.problem.limit > own.limit) == longer
    assert eased is fit or abs(eased.cost - fit.cost) < 2 * retune.SHOWN + 1
    assert np.array_equal(eased.u, fit.u)
    assert retune.quick(eased) is eased
