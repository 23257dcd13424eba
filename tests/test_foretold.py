"""What could be named: the foretold size is found, and half of it is not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, named, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.planning.plan import smallest
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse
from corexy_fmi.programs import named_command, programs, stage_limits
from corexy_fmi.simulate import simulate

STD = 2e-5
FEW = ("stribeck_friction", "belt_mismatch", "sensor_delay", "sensor_lag")
STRUCK = frozenset(catalogue()) - set(FEW)


def orders():
    found = programs(stage_limits(machine(), 0.08, 1.5))
    return {n: named_command(f"{n}.csv", found[n], machine()) for n in ("star", "strokes")}


@cache
def rows():
    """The table for a catalogue of four."""
    layout = bundled_layout()
    few = replace(layout, instances=tuple(i for i in layout.instances if i.effect.name in FEW))
    found = smallest(few, machine(), orders(), STD, map)
    return {(row.name, row.location): row for row in found}


@pytest.mark.long
def test_every_effect_and_place_is_told():
    assert {name for name, _ in rows()} == set(FEW)
    assert ("stribeck_friction", "xy") in rows()
    for row in rows().values():
        assert row.program in orders()


@pytest.mark.long
def test_less_noise_shows_smaller_effects():
    layout = bundled_layout()
    few = replace(layout, instances=tuple(i for i in layout.instances if i.effect.name in FEW))
    (quiet,) = (
        r
        for r in smallest(few, machine(), orders(), STD / 10, map)
        if (r.name, r.location) == ("belt_mismatch", "belts")
    )
    assert quiet.size == pytest.approx(rows()["belt_mismatch", "belts"].size / 10, rel=0.2)


def test_near_twins_are_told():
    assert rows()["sensor_delay", "sensor"].rival == "sensor_lag at sensor"


@pytest.mark.long
@pytest.mark.parametrize(("share", "verdict"), [(1.5, "explained"), (0.5, "nothing_missing")])
@pytest.mark.parametrize("effect", ["stribeck_friction", "belt_mismatch"])
def test_the_size_foretold_is_the_size_found(effect, share, verdict):
    settles(effect, {"stribeck_friction": "x", "belt_mismatch": "belts"}[effect], share, verdict)


@pytest.mark.long
@pytest.mark.parametrize(("share", "verdict"), [(1.5, "explained"), (1 / 1.5, "ambiguous")])
def test_a_rival_that_is_fitted_decides_the_size(share, verdict):
    """By the angle alone a third of this delay was told apart from a lag."""
    settles("sensor_delay", "sensor", share, verdict)


def settles(effect, place, share, verdict):
    """A share of the foretold size is diagnosed, and gets the verdict."""
    row = rows()[effect, place]
    rest = {"speed": 0.01} if effect == "stribeck_friction" else {}
    size = row.neutral + share * (row.size - row.neutral)
    truth = with_effects(machine(), EffectUse(effect, place, {row.parameter: size, **rest}))
    runs = [noisy(truth, orders()[row.program], seed) for seed in (1, 2)]
    document = diagnose(runs[:1], runs[1:], machine(), without=STRUCK).document
    assert document["verdict"] == verdict
    if verdict != "ambiguous":
        assert named(document) == ({(effect, place)} if verdict == "explained" else set())


def noisy(truth, order, seed):
    """What a truth shows on an order."""
    shown, random = simulate(truth, order), np.random.default_rng(seed)
    measured = {n: shown[n] + STD * random.normal(size=len(shown)) for n in ("x", "y")}
    return replace(order, name=f"{seed}.csv", channels={**order.channels, **measured})
