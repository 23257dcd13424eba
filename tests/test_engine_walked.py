"""Intervals walked along the likelihood: what curvature alone tells wrongly."""

from functools import cache

import pytest
from engine_kit import NOISE, STRIBECK, fitted, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.judging.model import covariance, effect_table, ends
from corexy_fmi.engine.naming.forms import UNTOLD
from corexy_fmi.engine.naming.whole import held
from corexy_fmi.engine.telling.walked import WIDE, _end, further, walked
from corexy_fmi.machine import EffectUse

PLANTED = {
    "racking": EffectUse("racking", "bridge", {"stiffness": 3000.0, "inertia": 1e-3}),
    "stribeck": STRIBECK,
    "cable": EffectUse("cable_drag", "x", {"stiffness": 200.0, "center": 0.0, "stiffening": 0.0}),
}
INERTIA, SPEED = "racking.bridge.inertia", "stribeck_friction.x.speed"
STIFFNESS = "racking.bridge.stiffness"
STIFFENING = "cable_drag.x.stiffening"
SHORT = 0.3  # of a logarithm: an interval that a ripple of the likelihood would tell


@cache
def fit(name: str, noise: float = NOISE, seed: int = 1):
    """What was planted, fitted to a recording of it."""
    use = PLANTED[name]
    shown = record(with_effects(machine(), use), rich_motion(), noise=noise, seed=seed)
    return fitted(problem(shown, machine(), [(use.name, use.location)], std=noise), 30)


def at(found, key: str, u: float) -> float:
    """What it costs [nats] to hold an unknown at u."""
    unknown = found.problem.unknowns[found.problem.keys.index(key)]
    return held(found, {key: float(unknown.value(u))}).cost - found.cost


def end(found, key: str, way: float) -> float:
    """Where an interval ends whose linear end is ``way`` off."""
    k = found.problem.keys.index(key)
    return _end(found, (k, float(found.u[k]) + way))


def test_an_inertia_that_nothing_shows_has_no_lower_end():
    found = fit("racking", seed=6)
    k = found.problem.keys.index(INERTIA)
    assert end(found, INERTIA, -SHORT) == found.problem.unknowns[k].range()[0]


def test_an_inertia_ends_where_its_mode_would_show():
    found = fit("racking", seed=6)
    k = found.problem.keys.index(INERTIA)
    top = end(found, INERTIA, SHORT)
    assert found.u[k] + SHORT < top < found.problem.unknowns[k].range()[1]
    assert at(found, INERTIA, top) == pytest.approx(UNTOLD, abs=1.2)


@pytest.mark.parametrize("way", [-SHORT, SHORT])
def test_a_speed_that_noise_hides_ends_where_it_costs_what_ends_an_interval(way):
    found = fit("stribeck", 1e-4)
    assert at(found, SPEED, end(found, SPEED, way)) == pytest.approx(UNTOLD, abs=0.6)


def test_where_all_is_linear_walking_ends_where_curvature_does():
    found = fit("stribeck", 4e-5)
    linear, k = ends(found)[SPEED], found.problem.keys.index(SPEED)
    for side in linear:
        way = side - float(found.u[k])
        assert end(found, SPEED, way / 2) - found.u[k] == pytest.approx(way, rel=0.25)


def test_what_is_well_known_is_not_walked():
    found = fit("stribeck")
    low, high = ends(found)[SPEED]
    assert high - low < 2 * WIDE
    assert walked(found, map) == {}


def test_what_is_at_the_least_that_is_allowed_is_walked_up():
    """A cable that does not stiffen."""
    found = fit("cable", 1e-4, 2)
    k = found.problem.keys.index(STIFFENING)
    assert found.value(STIFFENING) == 0.0
    low, high = walked(found, map)[STIFFENING]
    assert low == found.problem.unknowns[k].range()[0]
    assert at(found, STIFFENING, high) == pytest.approx(UNTOLD, abs=0.8)
    assert STIFFENING not in walked(fit("cable", 1e-4), map)


def test_an_interval_reaches_as_far_as_any_way_to_tell_it():
    found = fit("racking", seed=6)
    key, spread = ("racking", "bridge"), covariance(found)
    k = found.problem.keys.index(STIFFNESS)
    far = tuple(found.problem.unknowns[k].internal(v) for v in (500.0, 2e4))
    u = float(found.u[k])
    within, beyond = {STIFFNESS: (u, u)}, {STIFFNESS: far}
    plain, same, wide = (effect_table(found, *key, spread, f) for f in ([], [within], [beyond]))
    assert same == plain
    assert 500 < plain["stiffness"]["ci95"][0] < 3000 < plain["stiffness"]["ci95"][1] < 2e4
    assert wide["stiffness"]["ci95"] == pytest.approx([500.0, 2e4])
    assert wide["inertia"] == plain["inertia"]


def test_without_an_effect_nothing_is_walked():
    shown = record(machine(), rich_motion())
    assert further(fitted(problem(shown, machine()), 1), map) == []
