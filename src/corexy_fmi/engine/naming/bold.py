"""Bold starts: what catches and lets go is begun at its full size where nothing else pays.

A linear gain says little of friction that breaks away: near none of it the slope may even point
back, and a search that grows small signatures never leaves that place.  Fits from the declared size
cost more, and are worth it where the alternative is to tell nothing.  So are those of free-form
laws over an axis' own speed, from peaks near standstill.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, costs, minimise, settle
from corexy_fmi.engine.fitting.free_form import LawShape, law_places
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.rough import across
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.search import BENDING, LONG, PLAIN, rank
from corexy_fmi.engine.naming.signature import row_of
from corexy_fmi.engine.naming.spread import combinations, spread
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine.laws import AXES

TRIED, TRIED_LAWS = 2, 1  # starts of a place that are fitted, those that cost least
PEAKS, SPEEDS = (0.5, 1.0, 2.0), (0.03, 0.1, 0.3)  # of a law, in its scale and fastest knot


def bold_fits(base: Fit, singles: Sequence[Hypothesis], mapper: Mapper) -> list[Fit]:
    """Settled fits of single effects that bend, from their declared sizes, and of laws of friction
    from peaks; those that gain.
    """
    bending = [h for h in singles if _bends(h) or _breaks_away(h)]
    ended = list(mapper(lambda hypothesis: _fitted(base, hypothesis), bending))
    return list(mapper(settle, [fit for fit in ended if rank(fit) < base.cost]))


def _bends(hypothesis: Hypothesis) -> bool:
    """Whether an effect's size on a linear scale catches and lets go; on a logarithmic one the
    declared size is a start in any case.
    """
    effect = hypothesis.uses[-1].effect if hypothesis.uses else None
    return effect is not None and effect.state == BENDING and not effect.size.log


def _breaks_away(hypothesis: Hypothesis) -> bool:
    """Whether a free-form law is that of an axis over its own speed."""
    law = hypothesis.law
    return law is not None and law.location in AXES and law.argument == f"v{law.location}"


def _fitted(base: Fit, hypothesis: Hypothesis) -> Fit:
    """The best of the fits from the starts that cost least."""
    problem = replace(base.problem, hypothesis=hypothesis)
    u = problem.carried(base.problem, base.u)
    law = hypothesis.law
    starts = _peaks(problem, u, law) if law else _declared(problem, u, hypothesis, base)
    order = np.argsort(costs(problem.residual(starts)), kind="stable")
    tried = starts[order[: TRIED_LAWS if law else TRIED]]
    fits = [minimise(problem, start, LONG, PLAIN) for start in tried]
    return across(min(fits, key=lambda fit: fit.cost))


def _declared(problem: Problem, u: Array, hypothesis: Hypothesis, base: Fit) -> Array:
    """Starts (starts, size) of an effect as its file declares them."""
    instance = hypothesis.uses[-1]
    rows = combinations(instance, spread(base))
    return np.array([row_of(problem, u, instance, values) for values in rows])


def _peaks(problem: Problem, u: Array, law: LawShape) -> Array:
    """Starts (starts, size) of a law that holds back more the slower it goes, in some sizes."""
    speeds = np.array(law.knots)
    starts = np.tile(u, (len(PEAKS) * len(SPEEDS), 1))
    for start, (peak, share) in zip(starts, product(PEAKS, SPEEDS), strict=True):
        values = peak * np.sign(speeds) * np.exp(-((speeds / (share * speeds.max())) ** 2))
        start[law_places(problem.unknowns, law)] = values[law.own]
    return starts
