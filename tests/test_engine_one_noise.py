"""Near ties that leave errors of very different size are judged under the quieter one's noise."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion

from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.entries import entry_of
from corexy_fmi.engine.naming.one_noise import under_one_noise
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

TRUTH = ("constant_force", "x", {"force": 1.5})
SENSOR = 1e-7  # [m]: an encoder, far finer than what the model lacks


@cache
def fits():
    """The retuned machine, the right cause and a wrong one, each under noise of its own."""
    shown = record(replace(machine(), effects=(EffectUse(*TRUTH),)), rich_motion(), noise=SENSOR)
    base = retune(bundled_layout(), machine(), problem(shown, machine(), std=SENSOR).runs)
    found = []
    for name, location in (TRUTH[:2], ("quadratic_drag", "y")):
        hypothesis = Hypothesis((bundled_layout().find(name, location),))
        tried = replace(base.problem, hypothesis=hypothesis)
        found.append(settle(minimise(tried, tried.carried(base.problem, base.u))))
    return base, *found


def size(fit):
    return fit.problem.noise[0][0].marginal


def tied():
    """Both causes as good as each other by their own noise, the wrong one first."""
    base, right, wrong = fits()
    entries = [replace(entry_of(base, f), gain=g) for f, g in ((wrong, 60.0), (right, 50.0))]
    return base, entries


@pytest.mark.parametrize("gains", [(60.0, 50.0), (345.0, 259.0)], ids=["tied", "by a share"])
def test_the_quieter_of_two_tied_causes_tells_the_noise(gains):
    base, entries = tied()
    entries = [replace(e, gain=g) for e, g in zip(entries, gains, strict=True)]
    assert size(entries[0].fit) > 3 * size(entries[1].fit)
    retuned, judged = under_one_noise(base, entries, map)
    assert [e.hypothesis.uses[0].effect.name for e in judged] == [
        "constant_force",
        "quadratic_drag",
    ]
    assert judged[0].gain > judged[1].gain + 100
    assert {size(f) for f in (retuned, *(e.fit for e in judged))} == {size(entries[1].fit)}
    assert np.isfinite(retuned.cost)


def test_under_a_ceiling_all_are_judged_under_the_noise_of_the_first():
    """The others were held to it before, and stand far behind; nothing had its own noise."""
    base, (wrong, right) = tied()
    before = [replace(right, gain=60.0), replace(wrong, gain=-500.0)]
    assert under_one_noise(base, before, map) == (base, before)
    retuned, judged = under_one_noise(base, before, map, held=True)
    assert {size(f) for f in (retuned, *(e.fit for e in judged))} == {size(right.fit)}
    assert [e.hypothesis.uses[0].effect.name for e in judged] == [
        "constant_force",
        "quadratic_drag",
    ]
    assert judged[1].gain > -500.0
    faint = [replace(e, gain=5.0) for e in before]
    assert under_one_noise(base, faint, map, held=True) == (base, faint)


@pytest.mark.parametrize("gains", [(60.0, 5.0), (500.0, 50.0)], ids=["faint", "far behind"])
def test_one_that_is_not_as_good_tells_nothing(gains):
    base, entries = tied()
    apart = [replace(e, gain=g) for e, g in zip(entries, gains, strict=True)]
    assert under_one_noise(base, apart, map) == (base, apart)


def test_alike_ones_stay_as_they_are():
    base, (_, right) = tied()
    assert under_one_noise(base, [right, right], map) == (base, [right, right])
    assert under_one_noise(base, [], map) == (base, [])


def test_a_cause_that_takes_more_for_noise_than_nothing_does_gains_nothing_by_it():
    """Under a noise three times as loud, which the errors of nothing were not allowed."""
    base, (wrong, _) = tied()
    loud = tuple(
        tuple(replace(n, innovation=3 * n.innovation, marginal=3 * n.marginal) for n in models)
        for models in base.problem.noise
    )
    fit = replace(wrong.fit, problem=replace(wrong.fit.problem, noise=loud))
    _, [judged] = under_one_noise(base, [replace(wrong, fit=fit, gain=1000.0)], map)
    assert judged.fit.problem.noise == base.problem.noise
    assert judged.gain == pytest.approx(base.cost - rank(judged.fit))
    assert judged.gain < 500
