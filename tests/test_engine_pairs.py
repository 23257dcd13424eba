"""A second effect beside one: how much it must gain, and what else may speak for it."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest
from engine_kit import ASIDE, machine, named, record, rich_motion, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.naming import pairs as second
from corexy_fmi.engine.naming import worth
from corexy_fmi.engine.naming.specification import Leftover
from corexy_fmi.machine import EffectUse

FIRST = 10_000.0  # [nats] that the first effect gains
REFUTED, WHOLE = Leftover(45.0, 8.0, ""), Leftover(1.0, 0.2, "")
STARK, STARKER = Leftover(80.0, 15.0, ""), Leftover(300.0, 31.0, "")


def fit(cost, left, uses=(), law=None):
    hypothesis = SimpleNamespace(uses=uses, key=uses, law=law)
    problem = SimpleNamespace(noise="own", ceiling=None, hypothesis=hypothesis)
    return SimpleNamespace(cost=cost, left=left, problem=problem)


def sought(uses, cost):
    return fit(cost, WHOLE, uses)


@pytest.fixture
def plain(monkeypatch):
    """Fits that tell what they leave, without a price for parameters."""
    for module in (second, worth):
        monkeypatch.setattr(module, "rank", lambda fit: fit.cost)
        monkeypatch.setattr(module, "leftover", lambda fit: fit.left)
    monkeypatch.setattr(worth, "form_floor", lambda fit: 0.0)


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
        (600.0, STARK, REFUTED, True),
        (600.0, STARK, STARK, False),  # one of many that mend a form, and hardly
        (600.0, STARKER, STARK, True),
        (1_100.0, STARK, STARK, True),
    ],
)
def test_what_pays(gain, one, two, pays):
    base, single = fit(FIRST, REFUTED), fit(0.0, one)
    assert worth.pays(single, fit(-gain, two), base) is pays


@dataclass(frozen=True)
class Held:
    noise: str
    ceiling: str | None = None


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("gain", "pays"), [(9_000.0, True), (7_000.0, False)])
def test_under_a_ceiling_shares_are_of_what_one_gains_under_it(monkeypatch, gain, pays):
    """One that is held to it costs more than nothing does under the noise of nothing."""
    base, single = fit(0.0, REFUTED), fit(50_000.0, WHOLE)
    base.u, base.problem, single.problem = None, Held("own", "quiet"), Held("quiet")
    seen = []

    def minimise(problem, u, iterations):
        seen.append((problem.noise, iterations))
        return fit(250_000.0, REFUTED)

    monkeypatch.setattr(worth, "minimise", minimise)
    single.problem = replace(single.problem, noise=base.problem.ceiling)
    assert worth.pays(single, fit(50_000.0 - gain, WHOLE), base) is pays
    assert seen == [("quiet", 0)]


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("costs", "tried", "turn"),
    [
        ((-900.0, -890.0), {}, "play"),
        ((-900.0, -890.0), {"play": -900.0}, "steps"),
        ((-900.0, -890.0), {"play": -700.0}, "play"),  # it was stuck when it was tried
        ((-900.0, -800.0), {"play": -900.0}, None),  # far behind
        ((-900.0, -890.0), {"play": -900.0, "steps": -880.0}, None),
        ((-5.0, -4.0), {}, None),  # nothing is explained
    ],
)
def test_whose_turn_it_is(costs, tried, turn):
    fits = [sought((name,), cost) for name, cost in zip(("play", "steps"), costs, strict=True)]
    before = {(name,): cost for name, cost in tried.items()}
    found = second._turn(fit(0.0, REFUTED), [fit(-2_000.0, WHOLE), *fits], before)
    assert found is next((f for f in fits if f.problem.hypothesis.uses == (turn,)), None)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("law", "pair", "hopeless"),
    [(1_200.0, 300.0, True), (1_200.0, 450.0, False), (-5.0, 1.0, False), (None, 30.0, False)],
)
def test_pairs_far_behind_a_law_are_not_gone_on_with(law, pair, hopeless):
    base, fits = fit(0.0, REFUTED), [sought(("play",), -20.0)]
    if law is not None:
        fits.append(fit(-law, WHOLE, law="speed"))
    assert second._hopeless(fit(-pair, REFUTED), fits, base) is hopeless


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("left", "searches"),
    [
        ([WHOLE], ["play"]),
        ([REFUTED, WHOLE], ["play", "steps"]),
        ([REFUTED, REFUTED, WHOLE], ["play", "steps"]),  # no more than that
    ],
)
def test_what_is_about_as_good_has_its_turn_where_pairs_leave_something(
    monkeypatch, left, searches
):
    fits = [sought(("play",), -900.0), sought(("steps",), -890.0), sought(("drag",), -880.0)]
    asked = []

    def joining(base, one, fits, singles, mapper):
        asked.append(one.problem.hypothesis.uses[0])
        return base, [fit(-1_000.0 - len(asked), left[len(asked) - 1])]

    monkeypatch.setattr(second, "_joining", joining)
    monkeypatch.setattr(second, "at_resolution", lambda fit: False)
    base, found = second.pairs(fit(0.0, REFUTED), fits, [], map)
    assert asked == searches
    assert [f.cost for f in found] == [-1_002.0, -1_001.0][-len(asked) :]
    assert base.cost == 0.0


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
