"""What is gained without an effect's size is not gained by the effect."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, short_motion, with_effects

from corexy_fmi.engine.fitting.fit import Fit, costs
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.candidates import hypotheses
from corexy_fmi.engine.naming.entries import THRESHOLD, Entry, entry_of, shed, without_idle
from corexy_fmi.engine.naming.idle import idle, lighter
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.search import _shorts
from corexy_fmi.machine import EffectUse

SOFT = {"holding_torque": 0.1, "damping": 1e-3}


def standing(uses, *, torque, cogs=False):
    """A fit that stands at the truth, a soft rotor that cogs or does not, with the torque given."""
    (name, place), *_ = uses
    full = EffectUse("detent_torque", "motors", SOFT | {"torque": torque, "phase": 0.0})
    soft = EffectUse("stepper_compliance", "motors", SOFT)
    truth = with_effects(machine("gt2_printer"), full if cogs else soft)
    chosen = problem(record(truth, short_motion()), machine("gt2_printer"), uses)
    u = np.zeros(chosen.size)
    for k, unknown in enumerate(chosen.unknowns):
        known = SOFT | {"torque": torque}
        if unknown.key.startswith(f"{name}.{place}."):
            u[k] = unknown.internal(known.get(unknown.key.split(".")[-1], 0.0))
    residual = chosen.residual(u[None])[0]
    return Fit(chosen, u, float(costs(residual[None])[0]) + chosen.log_scale(), residual)


def test_a_torque_that_gains_nothing_is_idle_beside_the_soft_field():
    soft = standing([("stepper_compliance", "motors")], torque=0.0)
    cogging = standing([("detent_torque", "motors")], torque=1e-6)
    assert idle(cogging, THRESHOLD)
    assert not idle(soft, THRESHOLD)
    entries = [Entry(f.problem.hypothesis, f, gain) for f, gain in ((soft, 90.0), (cogging, 82.0))]
    assert without_idle(entries) == entries[:1]
    assert without_idle(entries[1:]) == entries[1:]


def test_a_torque_that_shows_is_not_idle():
    uses = [("detent_torque", "motors")]
    assert not idle(standing(uses, torque=0.05, cogs=True), THRESHOLD)


def beside_a_tight_spot(second, place, values):
    """A fit that stands at the truth, of a tight spot and a second effect with these values."""
    spot, tight = ("friction_vs_position", "y"), {"extra": 0.5, "center": 0.0, "width": 5e-3}
    truth = [EffectUse(*spot, tight), EffectUse(second, place, values)]
    shown = record(with_effects(machine("yin2018"), *truth), short_motion(), noise=2e-6)
    chosen = problem(shown, machine("yin2018"), [spot, (second, place)], 2e-6)
    u = np.zeros(chosen.size)
    for k, unknown in enumerate(chosen.unknowns):
        name = unknown.key.split(".")[-1]
        u[k] = unknown.internal((tight | values)[name]) if name in tight | values else 0.0
    residual = chosen.residual(u[None])[0]
    return Fit(chosen, u, float(costs(residual[None])[0]) + chosen.log_scale(), residual)


@pytest.mark.parametrize(("stiffness", "rigid"), [(5.8e6, True), (2e4, False)])
def test_bristles_as_stiff_as_their_range_allows_are_idle(stiffness, rigid):
    """No stiffer ones can be asked what they gain; none at all can."""
    fit = beside_a_tight_spot("presliding_hysteresis", "y", {"stiffness": stiffness})
    assert idle(fit, THRESHOLD) == rigid


@pytest.mark.parametrize(("pretension", "taut"), [(7e3, True), (0.5, False)])
def test_what_is_as_good_without_an_effect_is_told_without_it(pretension, taut):
    """Belts of 7 kN never go slack; those of 0.5 N do."""
    fit = beside_a_tight_spot("belt_slack", "belts", {"pretension": pretension})
    base = fitted(replace(fit.problem, hypothesis=Hypothesis()))
    entry = entry_of(base, fit)
    (told,) = shed(base, [entry], map)
    if not taut:
        assert lighter(fit, THRESHOLD) is fit
        assert told is entry
        return
    assert told.hypothesis.key == (("friction_vs_position", "y"),)
    assert told.gain > entry.gain
    assert shed(base, [told], map) == [told]


def test_effects_of_friction_get_a_short_fit_however_little_one_step_tells():
    base = fitted(problem(record(machine(), short_motion()), machine()))
    leads = screen(base, hypotheses(base.problem, base.u, frozenset()))
    fits = _shorts(leads, map, 1)
    bending = [h for h in (lead.hypothesis for lead in leads) if h.uses and
               h.uses[-1].effect.state == "velocity_reversal"]  # fmt: skip
    first = [f.problem.hypothesis.key for f in fits[: 1 + len(bending)]]
    assert len(bending) > 5
    assert {h.key for h in bending} <= set(first)


@pytest.mark.parametrize("gain", [5.0, 500.0])
def test_no_entries_and_single_ones_stay(gain):
    one = standing([("detent_torque", "motors")], torque=1e-6)
    assert without_idle([]) == []
    entry = Entry(one.problem.hypothesis, one, gain)
    assert without_idle([entry]) == [entry]
