"""Bold starts: what catches and lets go is begun at its declared size where nothing else pays.

A linear gain says little of friction that breaks away: near none of it the slope may even point
back, and a search that grows small signatures never leaves that place.  Fits from the declared size
cost more, and are worth it where the alternative is to tell nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, costs, minimise, settle
from corexy_fmi.engine.fitting.rough import across
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.search import BENDING, LONG, PLAIN, rank
from corexy_fmi.engine.naming.signature import row_of
from corexy_fmi.engine.naming.spread import combinations, spread

TRIED = 2  # declared starts of a place that are fitted, those that cost least


def bold_fits(base: Fit, singles: Sequence[Hypothesis], mapper: Mapper) -> list[Fit]:
    """Settled fits of single effects that bend, from their declared sizes; those that gain."""
    bending = [h for h in singles if h.uses and _bends(h)]
    ended = list(mapper(lambda hypothesis: _fitted(base, hypothesis), bending))
    return list(mapper(settle, [fit for fit in ended if rank(fit) < base.cost]))


def _bends(hypothesis: Hypothesis) -> bool:
    """Whether a size on a linear scale catches and lets go; on a logarithmic one the declared size
    is a start in any case.
    """
    effect = hypothesis.uses[-1].effect
    return effect.state == BENDING and not effect.size.log


def _fitted(base: Fit, hypothesis: Hypothesis) -> Fit:
    """The best of the fits from the declared starts that cost least."""
    problem, instance = replace(base.problem, hypothesis=hypothesis), hypothesis.uses[-1]
    u = problem.carried(base.problem, base.u)
    rows = combinations(instance, spread(base))
    starts = np.array([row_of(problem, u, instance, values) for values in rows])
    order = np.argsort(costs(problem.residual(starts)), kind="stable")[:TRIED]
    fits = [minimise(problem, start, LONG, PLAIN) for start in starts[order]]
    return across(min(fits, key=lambda fit: fit.cost))
