"""Pairs in which one cause strikes at a time of its own, begun again with that found anew.

A search of all times beside one cause alone may end at a wrong one, where the other is yet to be
found; no fit moves a time past what lies between.  Once the other is there, the place in time where
what it leaves jumps is plain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle_no_dearer
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.screen import by_one_run, screen
from corexy_fmi.engine.naming.search import long_fit, rank, short_fits
from corexy_fmi.kernel.layout import Instance


def retimed(two: Fit, singles: Sequence[Hypothesis], mapper: Mapper) -> Fit:
    """The better of a settled pair and itself with what strikes at a time of its own found anew
    beside the other cause, at any of its places among ``singles``.
    """
    for instance in two.problem.hypothesis.uses:
        if by_one_run(instance):
            two = min(two, _anew(two, instance, singles, mapper), key=rank)
    return two


def _anew(two: Fit, instance: Instance, singles: Sequence[Hypothesis], mapper: Mapper) -> Fit:
    """The pair with one of its causes searched for beside the other, which stays where it is."""
    pair = two.problem.hypothesis
    others = tuple(i for i in pair.uses if i is not instance)
    alone = replace(two.problem, hypothesis=replace(pair, uses=others, held=()))
    start = minimise(alone, alone.carried(two.problem, two.u), 0)
    if not np.isfinite(start.cost):
        return two
    places = [i for s in singles for i in s.uses if i.effect.name == instance.effect.name]
    sought = [Hypothesis((*others, place), shaped=pair.shaped) for place in places]
    fits = short_fits(screen(start, sought, mapper), mapper)
    return settle_no_dearer(long_fit(fits[0]))
