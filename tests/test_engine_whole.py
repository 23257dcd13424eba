"""Counts are whole: a rotor falls back by whole steps, and a part of one is another effect."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import machine, problem, record, short_motion, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import WITHIN
from corexy_fmi.engine.naming import whole as whole_module
from corexy_fmi.engine.naming.name import compete
from corexy_fmi.engine.naming.whole import _beside, broken, whole, with_whole_counts
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

PLACE = ("missed_steps", "motor1")
STEPS, TIME = (f"missed_steps.motor1.{p}@train.csv" for p in ("steps", "time"))
NOISE = 5e-6  # [m]


@cache
def fitted(steps):
    """The fit from beside the truth of so many steps, as any number."""
    truth = EffectUse(*PLACE, {"steps": steps, "time": 0.4})
    shown = record(with_effects(machine(), truth), short_motion(), noise=NOISE)
    chosen = problem(shown, machine(), [PLACE], std=NOISE)
    start = np.zeros(chosen.size)
    for k, x in enumerate(chosen.unknowns):
        if x.key in (STEPS, TIME):
            start[k] = x.internal({STEPS: steps + 0.3, TIME: 0.41}[x.key])
    return minimise(chosen, start, 20)


@pytest.mark.parametrize("steps", [-3.0, 1.0, 2.0])
def test_whole_steps_stay_as_they_were_fitted(steps):
    fit = fitted(steps)
    assert fit.value(STEPS) == pytest.approx(steps, abs=WITHIN * abs(steps))
    assert whole(fit) is fit


@pytest.mark.parametrize(("steps", "least"), [(1.6, (1, 2)), (-1.4, (-2, -1)), (0.4, (1,))])
def test_a_part_of_a_step_has_to_pay_as_whole_ones(steps, least):
    fit = fitted(steps)
    assert fit.value(STEPS) == pytest.approx(steps, abs=0.05)
    held = whole(fit)
    near = round(held.value(STEPS))
    assert near in least
    assert abs(held.value(STEPS) - near) <= WITHIN * abs(near) + 1e-9
    assert held.cost > fit.cost + 50  # [nats] that the part of a step is worth
    assert whole(held) is held


def test_many_steps_that_are_no_whole_number_are_told():
    """A belt that jumped a tooth is 13.3 steps off."""
    held = whole(fitted(13.33))
    assert held.value(STEPS) == pytest.approx(13 * (1 + WITHIN), rel=1e-6)
    assert broken(held) == "13.13 steps, where no whole number of them fits"


@pytest.mark.parametrize("steps", [-13.0, 1.0, 1.6])
def test_whole_steps_and_few_are_not_doubted(steps):
    assert broken(whole(fitted(steps))) == ""


def test_sets_beside_are_near_first_and_never_nothing():
    assert _beside({"a": -1.64, "b": 3.1}) == [{"a": -2, "b": 3}, {"a": -1, "b": 3}]
    assert _beside({"a": 0.1, "b": -0.2}) == [{"a": 0, "b": -1}]
    assert _beside({"a": 0.4}) == [{"a": 1}]


def test_a_competition_ends_with_whole_steps():
    """Of a truth that lost 1.6 steps, which no rotor does."""
    base = retune(bundled_layout(), machine(), fitted(1.6).problem.runs)
    entries = compete(base, map, without=frozenset(catalogue()) - {PLACE[0]}).entries
    jumps = [e for e in entries if e.hypothesis.key == (PLACE,)]
    assert len(jumps) == 1
    assert round(jumps[0].fit.value(STEPS)) in (1, 2)
    assert dict(jumps[0].hypothesis.held)[STEPS] in (1, 2)


def test_counts_of_the_best_cause_are_whole_however_far_a_law_is_ahead():
    """A part of a step had 3000 nats less than a law, and all of the pairs were to join it."""

    def fit(name, cost, counts, law=None):
        uses = () if law else (name,)
        hypothesis = SimpleNamespace(law=law, uses=uses, shaped=False)
        return SimpleNamespace(problem=SimpleNamespace(hypothesis=hypothesis), cost=cost, n=counts)

    law, part = fit("law", -3000.0, 0, law="over x"), fit("missed_steps", -100.0, 0.2)
    other, far = fit("backlash", -50.0, 0), fit("missed_steps", 0.0, 0.3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole_module, "rank", lambda f: f.cost)
        patch.setattr(whole_module, "is_whole", lambda f: f.n == round(f.n))
        patch.setattr(whole_module, "whole", lambda f: fit("missed_steps", f.cost + 90.0, 1))
        found = with_whole_counts([part, law, far, other], map)
    assert [f.cost for f in found] == [-3000.0, -50.0, -10.0, 0.0]
    assert [f.n for f in found] == [0, 0, 1, 0.3]
