"""A free-form law as smooth as its data ask: many knots, their bending weighed by evidence.

Few knots cannot follow a curve, many follow the noise.  So a law gets all that there is room for,
and a prior under which a curve that bends more is less likely; how much less is chosen where the
data are most probable (MacKay, Neural Computation 4(3), 1992, doi:10.1162/neco.1992.4.3.415), in
the linearised problem, with all other unknowns free.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.free_form import LawShape, bending, law_places, law_values
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.candidates import finer
from corexy_fmi.engine.naming.entries import Competition
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import KNOTS

RELATIVE = np.logspace(-6.0, 4.0, 41)  # weights of bending, in units of the data's own
ITERATIONS = 6


def with_smooth_law(competition: Competition) -> Competition:
    """The competition with a free-form law that leads as smooth as is most probable; what it
    gains, by which it won, stays as it was.
    """
    first = competition.best
    if first is None or not first.hypothesis.law:
        return competition
    fit = smoothed(first.fit)
    told = replace(first, hypothesis=fit.problem.hypothesis, fit=fit)
    return replace(competition, entries=(told, *competition.entries[1:]))


def smoothed(fit: Fit) -> Fit:
    """A free-form law with all knots that there is room for, as smooth as is most probable; any
    other fit as it is, and one that more than noise would be lost of.
    """
    if fit.problem.hypothesis.law is None:
        return fit
    many = _with_finer_knots(fit)
    bent = _with_stiffness(many, _most_probable(many))
    lost = bent.cost - _prior_of_bending(bent) - many.cost
    return bent if lost < len(law_places(many.problem.unknowns)) else fit


def _with_finer_knots(fit: Fit) -> Fit:
    """The fit of a law with a knot more between any two, while there is room."""
    law = fit.problem.hypothesis.law
    assert law is not None
    twice = finer(law)
    if len(twice.knots) > KNOTS:
        return minimise(fit.problem, fit.u, ITERATIONS)
    at = law_places(fit.problem.unknowns)
    values = np.interp(twice.knots, law.knots, law_values(fit) / law.scale)[twice.own]
    start = np.concatenate([fit.u[: at[0]], values, fit.u[at[-1] + 1 :]])
    return _with_finer_knots(minimise(_of(fit, twice), start, ITERATIONS))


def _most_probable(fit: Fit) -> float:
    """The weight of a law's bending under which the data are most probable."""
    law, at = fit.problem.hypothesis.law, law_places(fit.problem.unknowns)
    assert law is not None
    known, values = _learnt(fit, at), fit.u[at]
    bent = bending(law)
    free, price = np.diag(fit.problem.prior[1][at] ** 2), bent.T @ bent
    weights = RELATIVE * np.trace(known) / np.trace(price)
    return float(max(weights, key=lambda w: _log_evidence(known, free, w * price, values)))


def _log_evidence(known: Array, free: Array, price: Array, values: Array) -> float:
    """Log probability of the data, but for what no price changes: precision ``known`` of the
    ``values`` that fit best, ``free`` of the prior in it, ``price`` of bending beside.
    """
    total = known + price
    pulled = known @ values
    cost = 0.5 * (values @ pulled - pulled @ np.linalg.solve(total, pulled))
    return float(-cost - 0.5 * (np.linalg.slogdet(total)[1] - np.linalg.slogdet(free + price)[1]))


def _learnt(fit: Fit, at: list[int]) -> Array:
    """Precision (k, k) of some unknowns, all others free."""
    normal, own = fit.jacobian.T @ fit.jacobian, np.array(at)
    others = np.setdiff1d(np.arange(len(normal)), own)
    across, rest = normal[np.ix_(own, others)], normal[np.ix_(others, others)]
    return np.asarray(normal[np.ix_(own, own)] - across @ np.linalg.lstsq(rest, across.T)[0])


def _with_stiffness(fit: Fit, stiffness: float) -> Fit:
    """The law fitted with its bending weighed."""
    law = fit.problem.hypothesis.law
    assert law is not None
    return minimise(_of(fit, replace(law, stiffness=stiffness)), fit.u, ITERATIONS)


def _prior_of_bending(fit: Fit) -> float:
    """What bending costs a fit [nats]."""
    law, at = fit.problem.hypothesis.law, law_places(fit.problem.unknowns)
    assert law is not None
    return float(0.5 * law.stiffness * np.sum((bending(law) @ fit.u[at]) ** 2))


def _of(fit: Fit, law: LawShape) -> Problem:
    return replace(fit.problem, hypothesis=Hypothesis(law=law))
