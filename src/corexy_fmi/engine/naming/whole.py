"""Counts are whole: a rotor falls back by whole steps, and a part of one is another effect.

An effect's count is fitted as any number; then the fit is begun again with it held near the whole
numbers beside where it ended, none of which may be all zero.  A jump of 1.6 steps has to pay as two
or as one: what an offset, a loose pulley or a slow drift shows is not taken for lost steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle_no_dearer
from corexy_fmi.engine.fitting.restart import best
from corexy_fmi.engine.fitting.unknowns import WITHIN
from corexy_fmi.engine.naming.search import CLOSE, rank

AGAIN = 8  # iterations of a fit with its counts held
CLEAR = 0.25  # from a whole number up to which only that one is tried
SLIGHT, AT_END = 0.05, 0.98  # [steps] of room that tells nothing; share of it that is its end
MOST = 8  # sets of counts that are tried


def with_whole_counts(fits: list[Fit], mapper: Mapper) -> list[Fit]:
    """Fits, best first, those near the best catalogued one with their counts near whole numbers,
    however far a law is ahead: else a part of a step is what others are to join.
    """
    fits = sorted(fits, key=rank)
    while broken := [f for f in _leading(fits) if not is_whole(f)]:
        kept = [f for f in fits if f not in broken]
        fits = sorted([*kept, *mapper(whole, broken)], key=rank)
    return fits


def _leading(fits: list[Fit]) -> list[Fit]:
    """Catalogued fits near the best of them."""
    named = [f for f in fits if f.problem.hypothesis.uses]
    return [f for f in named if rank(f) < rank(named[0]) + CLOSE]


def is_whole(fit: Fit) -> bool:
    """Whether a fit's counts are near whole numbers, or it has none."""
    counts = _counts(fit).values()
    return bool(fit.problem.hypothesis.held) or all(_near(value) for value in counts)


def whole(fit: Fit) -> Fit:
    """The fit with its counts held near the whole numbers beside them that cost least."""
    if is_whole(fit):
        return fit
    return settle_no_dearer(best([held(fit, counts) for counts in _beside(_counts(fit))]))


def _counts(fit: Fit) -> dict[str, float]:
    """Value of each count among the unknowns, by key."""
    marked = {
        f"{i.effect.name}.{i.location}.{p.name}"
        for i in fit.problem.hypothesis.uses
        for p in i.effect.parameters
        if p.whole
    }
    return {
        x.key: float(x.value(fit.u[k]))
        for k, x in enumerate(fit.problem.unknowns)
        if x.key.partition("@")[0] in marked
    }


def _near(value: float) -> bool:
    return abs(value - round(value)) <= WITHIN * abs(round(value))


def broken(fit: Fit) -> str:
    """Words for a count that ended where it is farthest from a whole number that it may be, and
    surely would go on; empty where none did.  Of few steps so little is within what a fit ends by.
    """
    for value in _counts(fit).values():
        room = WITHIN * abs(round(value))
        if room > SLIGHT and abs(value - round(value)) > AT_END * room:
            return f"{abs(value):.2f} steps, where no whole number of them fits"
    return ""


def _beside(found: dict[str, float]) -> list[dict[str, int]]:
    """Sets of whole numbers beside those found, the nearest first, none of them all zero."""
    each = []
    for value in found.values():
        near = round(value)
        other = near + (1 if value > near else -1)
        each.append((near,) if abs(value - near) < CLEAR else (near, other))
    sets = [s for s in product(*each) if any(s)]
    if not sets:  # nowhere half a step: one step where there is most
        values = np.array(list(found.values()))
        most = int(np.argmax(np.abs(values)))
        sets = [tuple(int(np.sign(v)) * (k == most) or 0 for k, v in enumerate(values))]
    return [dict(zip(found, s, strict=True)) for s in sets[:MOST]]


def held(fit: Fit, numbers: Mapping[str, float]) -> Fit:
    """The fit once more with unknowns held near numbers, beside those that it holds already."""
    both = {**dict(fit.problem.hypothesis.held), **numbers}
    problem = replace(
        fit.problem, hypothesis=replace(fit.problem.hypothesis, held=tuple(both.items()))
    )
    return minimise(problem, np.clip(fit.u, *problem.limits()), AGAIN)
