"""Shares between two laws of the literature: one of them is taken where the data do not tell."""

from functools import cache

import numpy as np
import pytest
from engine_kit import ASIDE, machine, pair, problem, record, short_motion, with_effects
from engine_kit import fitted as fitted_bare

from corexy_fmi.effects import catalogue
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.judging.model import Z95, covariance
from corexy_fmi.engine.naming.entries import entry_of
from corexy_fmi.engine.naming.forms import UNTOLD, at_form, at_forms
from corexy_fmi.machine import EffectUse

SIZES = {
    "belt_hardening": ("yin2018", "belts", {"coefficient": 100.0}),
    "belt_stiffness_vs_position": ("yin2018", "belts", {"strength": 0.5}),
    "driver_deadband": ("yin2018_dc", "motors", {"voltage": 0.3}),
    "friction_warmup": ("yin2018", "x", {"extra_ratio": 1.0, "time_constant": 0.5}),
    "load_friction": ("yin2018", "x", {"coefficient": 0.2}),
    "presliding_hysteresis": ("yin2018", "x", {"stiffness": 8e3}),
    "stribeck_friction": ("yin2018", "x", {"static_ratio": 2.5, "speed": 0.012}),
    "supply_saturation": ("yin2018_dc", "motors", {"voltage": 0.6}),
    "torque_ripple": ("yin2018_dc", "motors", {"ratio": 0.1, "order": 24.0, "phase": 0.4}),
}
SHARES = [(e, p) for e in catalogue().values() for p in e.parameters if p.forms]
EACH = pytest.mark.parametrize(("effect", "share"), SHARES, ids=[e.name for e, _ in SHARES])
NOISE = 2e-7  # [m]


@cache
def fitted(name, parameter, value, noise=NOISE):
    """The fit from the truth, its share at a value."""
    nominal, location, numbers = SIZES[name]
    truth = EffectUse(name, location, numbers | {parameter: value})
    shown = record(with_effects(machine(nominal), truth), short_motion(), noise=noise)
    chosen = problem(shown, machine(nominal), [(name, location)], std=noise)
    start = chosen.carried(chosen, 0 * chosen.prior[0])
    for k, x in enumerate(chosen.unknowns):
        known = truth.parameters.get(x.key.partition("@")[0].rpartition(".")[2])
        start[k] = start[k] if known is None or "." not in x.key else x.internal(known)
    return minimise(chosen, start, 20), f"{name}.{location}.{parameter}"


@EACH
def test_laws_are_within_the_bounds(effect, share):
    assert all(share.lower <= value <= share.upper for value in share.forms)
    assert share.default in share.forms


@EACH
@pytest.mark.parametrize("law", [0.0, 1.0])
def test_the_law_is_found(effect, share, law):
    fit, key = fitted(effect.name, share.name, law)
    there = at_form(fit)
    assert there.value(key) == pytest.approx(law, abs=1e-9)
    assert there.cost < fit.cost + UNTOLD
    assert there.problem is fit.problem  # as free as before: its interval is as wide


@EACH
def test_what_the_data_tell_from_both_laws_stays(effect, share):
    fit, key = fitted(effect.name, share.name, 0.5)
    assert fit.value(key) == pytest.approx(0.5, abs=0.2)
    assert at_form(fit) is fit


def test_a_law_is_taken_from_far_where_noise_hides_it():
    fit, key = fitted("supply_saturation", "soft", 0.5, 1e-3)
    assert at_form(fit).value(key) in (0.0, pytest.approx(1.0, abs=1e-9))


def test_a_fit_without_shares_stays():
    shown = record(machine(), short_motion())
    fit = fitted_bare(problem(shown, machine()), 0)
    assert at_form(fit) is fit


def test_entries_keep_what_they_gained():
    fit, key = fitted("supply_saturation", "soft", 1.0)
    entry = entry_of(fit, fit)
    (moved,) = at_forms([entry], map)
    assert moved.gain == pytest.approx(max(entry.gain, entry.gain + fit.cost - moved.fit.cost))
    assert moved.fit.value(key) == pytest.approx(1.0, abs=1e-9)


@EACH
def test_an_interval_reaches_from_one_law_to_the_other_where_nothing_is_told(effect, share):
    fit, key = fitted(effect.name, share.name, 1.0, 1e-3)
    k = fit.problem.keys.index(key)
    reach = Z95 * np.sqrt(covariance(fit)[k, k]) * fit.problem.unknowns[k].scale
    assert 0.2 < reach <= max(share.forms) - min(share.forms) + 1e-9


@pytest.mark.long
def test_a_band_that_the_cost_steps_over_has_an_interval():
    """By differences over thousandths a dead band has no slope where the fit stands, and began
    again at one of its laws it lost the slopes that were averaged: its interval was all that is
    allowed, and data kept back refuted what they know.
    """
    band = EffectUse("driver_deadband", "motors", {"voltage": 0.1, "lost": 0.0})
    nominal = machine("yin2018_dc")
    found = diagnose(*pair(with_effects(nominal, band, **ASIDE), noise=1e-5), nominal, jobs=2)
    assert found.document["verdict"] == "explained"
    (effect,) = found.document["effects"]
    low, high = effect["parameters"]["voltage"]["ci95"]
    assert 0.05 < low < 0.1 < high < 0.2
