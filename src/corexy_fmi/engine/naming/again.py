"""Fits begun again: from where another hypothesis ended, from beside an end, with finer laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, fine, minimise, settle, settle_no_dearer
from corexy_fmi.engine.fitting.free_form import PARITIES, LawShape, halved, law_places, law_values
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.restart import LEADER, begun, best
from corexy_fmi.engine.fitting.rough import across, unstuck
from corexy_fmi.engine.fitting.starts import astray, balanced, centred
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.candidates import finer
from corexy_fmi.engine.naming.entries import Entry, entry_of
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import KNOTS

SHAKE, AGAIN = 1.0, 8  # from how far beside, iterations
BETTER = 1.0  # [nats] that it must gain to be taken
ASTRAY = 1.5  # prior standard deviations of a nominal parameter


def repolish(base: Fit, winner: Fit) -> Fit:
    """The retuned machine refitted from a winner's nominal parameters; the better of both."""
    start = base.problem.carried(winner.problem, winner.u)
    other = settle(minimise(base.problem, start))
    return other if other.cost < base.cost else base


def refined(fit: Fit) -> Fit:
    """A free-form law with twice the knots, where they pay and a machine holds them; any other fit
    as it is.
    """
    law = fit.problem.hypothesis.law
    if law is None or 2 * len(law.knots) - 1 > KNOTS:
        return fit
    twice = finer(law)
    again = settle(with_laws(fit, [twice], [np.interp(twice.knots, law.knots, law_values(fit))]))
    return again if rank(again) < rank(fit) else fit


def with_laws(fit: Fit, shapes: Sequence[LawShape], values: Sequence[Array]) -> Fit:
    """The problem of a fit with these laws, fitted from where that ended and from these values
    (knots,) of each.
    """
    first, *beside = shapes
    hypothesis = Hypothesis(law=first, beside=beside[0] if beside else None)
    problem = replace(fit.problem, hypothesis=hypothesis)
    start = problem.carried(fit.problem, fit.u)
    _share_times(problem, start, fit, hypothesis.laws)
    for law, own in zip(hypothesis.laws, values, strict=True):
        start[law_places(problem.unknowns, law)] = own[law.own] / law.scale
    return minimise(problem, start, AGAIN)


def _share_times(problem: Problem, start: Array, fit: Fit, laws: Sequence[LawShape]) -> None:
    """Give laws that a fit had not the times of its first one, in ``start`` (size,)."""
    known, first = dict(zip(fit.problem.keys, fit.u, strict=True)), f"free_form.{laws[0].location}."
    for k, key in enumerate(problem.keys):
        name = key.removeprefix("free_form.").partition(".")[2]
        if key not in known and key.startswith("free_form.") and "values[" not in name:
            start[k] = known.get(first + name, 0.0)


def recentred(fit: Fit, mapper: Mapper) -> Fit:
    """The better of a fit and, where its nominal parameters went astray, itself begun again around
    those of the machine file: they may have moved to explain the mismatch before the effect was
    there to do it.
    """
    found = [across(minimise(fit.problem, u, AGAIN)) for u in _central(fit, mapper)]
    ended = best([fit, *found])
    return settle_no_dearer(ended) if ended.cost < fit.cost - BETTER else fit


def begun_in_balance(fit: Fit) -> Fit:
    """The better of a fit and, where it has a run begin far from balance, itself begun again with
    all in balance: retuning may have led it there, and no slope leads back.
    """
    u = balanced(fit)
    if u is None:
        return fit
    found = settle_no_dearer(minimise(fit.problem, u))
    return found if found.cost < fit.cost - BETTER else fit


def _central(fit: Fit, mapper: Mapper) -> list[Array]:
    """Where to begin around the machine file's nominal parameters, (size,) each; nowhere where all
    of them stayed near.
    """
    if astray(fit) < ASTRAY:
        return []
    around = centred(fit)
    return [around, best(begun(fit.problem, around, LEADER, mapper)).u]


def by_parity(fit: Fit) -> Fit:
    """A law whose knots lie alike on both sides of zero, as over a speed, as an odd or an even one,
    where its other half does not pay: half as many values are known better.  Any other, and one
    that is halved already, as it is.
    """
    law = fit.problem.hypothesis.law
    if law is None or law.parity or not np.allclose(law.knots, -np.array(law.knots[::-1])):
        return fit
    found = [fit]
    for parity in PARITIES:
        hypothesis, start = halved(fit, parity)
        problem = replace(fit.problem, hypothesis=hypothesis)
        found.append(minimise(problem, start, AGAIN))
    return min(found, key=rank)


def polished(one: Fit, two: Fit) -> Fit:
    """The better of a fit and itself begun again where the fit with a second effect ended."""
    again = settle_no_dearer(minimise(one.problem, one.problem.carried(two.problem, two.u)))
    return again if again.cost < one.cost else one


def shaken(fit: Fit, mapper: Mapper) -> Fit:
    """A fit begun again from beside where it ended: dry friction leaves many minima close by.

    Each of the effects' parameters but their sizes is pushed by its scale, up and down; the best
    end is carried on over rough ground.
    """
    shapes = {
        f"{i.effect.name}.{i.location}.{p.name}"
        for i in fit.problem.hypothesis.uses
        for p in i.effect.parameters
        if not p.size
    }
    moved = [k for k, key in enumerate(fit.problem.keys) if key in shapes]
    starts = [fit.u + SHAKE * sign * np.eye(len(fit.u))[k] for k in moved for sign in (-1, 1)]
    starts += [best(begun(fit.problem, fit.u, LEADER, mapper)).u, *_central(fit, mapper)]
    again = list(mapper(lambda u: minimise(fit.problem, u, AGAIN), starts))
    found = unstuck(best([fit, *again]))
    return settle_no_dearer(found) if found.cost < fit.cost - BETTER else fit


def matched(base: Fit, entries: list[Entry]) -> tuple[Fit, list[Entry]]:
    """The retuned machine begun again where the winner ended, and what all gain over that."""
    if not entries:
        return base, entries
    again = fine(repolish(base, entries[0].fit))
    lost = base.cost - again.cost
    first = entry_of(base, fine(entries[0].fit))
    return again, [replace(e, gain=e.gain - lost) for e in (first, *entries[1:])]
