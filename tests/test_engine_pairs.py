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


@pytest.mark.long
def test_a_skew_is_told_beside_steps_that_were_lost():
    """It gains 3 % of what they do; without it simple functions of the motion gain 60 nats."""
    lost = EffectUse("missed_steps", "motor1", {"steps": 4.0, "time": 3.0})
    skew = EffectUse("axis_skew", "sensor", {"angle": 1.8e-4})
    truth = with_effects(machine("light_bench"), lost, skew, **ASIDE)
    shown = record(truth, rich_motion(), noise=8e-6)
    document = diagnose([shown], [], machine("light_bench"), jobs=2).document
    assert named(document) == {("missed_steps", "motor1"), ("axis_skew", "sensor")}
