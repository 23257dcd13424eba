"""A second effect beside one: how much it must gain, and what else may speak for it."""

from types import SimpleNamespace

import pytest
from engine_kit import ASIDE, machine, named, record, rich_motion, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.naming import pairs as second
from corexy_fmi.engine.naming.specification import Leftover
from corexy_fmi.machine import EffectUse

FIRST = 10_000.0  # [nats] that the first effect gains
REFUTED, WHOLE = Leftover(45.0, 8.0, ""), Leftover(1.0, 0.2, "")
STARK = Leftover(80.0, 15.0, "")


def fit(cost, left):
    return SimpleNamespace(cost=cost, left=left)


def sought(uses, cost):
    found = fit(cost, WHOLE)
    found.problem = SimpleNamespace(hypothesis=SimpleNamespace(uses=uses))
    return found


@pytest.fixture
def plain(monkeypatch):
    """Fits that tell what they leave, without a price for parameters."""
    monkeypatch.setattr(second, "rank", lambda fit: fit.cost)
    monkeypatch.setattr(second, "form_floor", lambda fit: 0.0)
    monkeypatch.setattr(second, "leftover", lambda fit: fit.left)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("gain", "one", "two", "pays"),
    [
        (500.0, WHOLE, WHOLE, True),  # more than a wrong form of the first one may leave
        (300.0, WHOLE, WHOLE, False),
        (300.0, REFUTED, WHOLE, True),
        (300.0, REFUTED, REFUTED, False),
        (40.0, REFUTED, WHOLE, False),
        (40.0, STARK, WHOLE, True),  # no wrong form leaves as much, whatever the share
        (40.0, STARK, REFUTED, False),
        (5.0, STARK, WHOLE, False),
    ],
)
def test_what_pays(gain, one, two, pays):
    base, single = fit(FIRST, REFUTED), fit(0.0, one)
    assert second._pays(single, fit(-gain, two), base) is pays


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("gain", "one", "two", "again"),
    [
        (300.0, REFUTED, REFUTED, True),
        (300.0, REFUTED, WHOLE, False),  # it pays as it is
        (300.0, WHOLE, REFUTED, False),  # nothing speaks against the first one alone
        (500.0, REFUTED, REFUTED, False),
        (40.0, REFUTED, REFUTED, False),
        (40.0, STARK, STARK, True),
    ],
)
def test_what_is_begun_again(monkeypatch, gain, one, two, again):
    monkeypatch.setattr(second, "shaken", lambda fit, mapper: "shaken")
    pair = fit(-gain, two)
    found = second._completed(fit(0.0, one), pair, fit(FIRST, REFUTED), map)
    assert found == ("shaken" if again else pair)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("alone", "stays"), [(-490.0, False), (-20.0, True)])
def test_a_second_effect_that_led_the_first_one_out_is_not_its_pair(monkeypatch, alone, stays):
    """A tight spot was stuck at 13 nats, gained 90 beside bristles that did nothing, and 92 from
    where both had ended.
    """
    first, stuck = sought(("drag",), 0.0), sought(("spot",), 5.0)
    both = sought(("spot", "bristles"), -500.0)
    fits = [first, stuck, sought(("drag",), 10.0)]
    began = []

    def polished(one, two):
        began.append((one, two))
        return sought(("spot",), alone)

    monkeypatch.setattr(second, "polished", polished)
    found = second.paying([both], fits, fit(FIRST, REFUTED), map)
    assert found == ([both] if stays else [])
    assert began == [(stuck, both)]
    assert [f.cost for f in fits] == [0.0, alone, 10.0]


@pytest.mark.usefixtures("plain")
def test_nothing_is_begun_again_for_a_pair_that_does_not_pay(monkeypatch):
    monkeypatch.setattr(second, "polished", None)
    fits = [sought(("drag",), 0.0), sought(("spot",), 5.0)]
    assert second.paying([sought(("spot", "drag"), -20.0)], fits, fit(FIRST, REFUTED), map) == []


@pytest.mark.long
def test_a_skew_is_told_beside_steps_that_were_lost():
    """It gains 3 % of what they do; without it simple functions of the motion gain 60 nats."""
    lost = EffectUse("missed_steps", "motor1", {"steps": 4.0, "time": 3.0})
    skew = EffectUse("axis_skew", "sensor", {"angle": 1.8e-4})
    truth = with_effects(machine("light_bench"), lost, skew, **ASIDE)
    shown = record(truth, rich_motion(), noise=8e-6)
    document = diagnose([shown], [], machine("light_bench"), jobs=2).document
    assert named(document) == {("missed_steps", "motor1"), ("axis_skew", "sensor")}
