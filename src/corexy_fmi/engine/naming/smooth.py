"""A free-form law as it is told: along both axes where that pays, as smooth as its data ask.

Few knots cannot follow a curve, many follow the noise.  So a law gets all that there is room for,
and a prior under which a curve that bends more is less likely; how much less is chosen where the
data are most probable (MacKay, Neural Computation 4(3), 1992, doi:10.1162/neco.1992.4.3.415), in
the linearised problem, with all other unknowns free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.free_form import LawShape, bending, law_places, law_values
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.candidates import finer, laws
from corexy_fmi.engine.naming.entries import THRESHOLD, Competition, Entry
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import KNOTS
from corexy_fmi.machine.laws import AXES

RELATIVE = np.logspace(-6.0, 4.0, 41)  # weights of bending, in units of the data's own
ITERATIONS = 6
OTHER = {"vx": "vy", "vy": "vx", "x": "y", "y": "x"}  # what a law of the other axis depends on


def with_smooth_law(competition: Competition) -> Competition:
    """The competition with a free-form law that leads as it is told."""
    first = competition.best
    if first is None or not first.hypothesis.law:
        return competition
    return replace(competition, entries=(as_told(first), *competition.entries[1:]))


def as_told(entry: Entry) -> Entry:
    """A free-form law along both axes where that pays, and smooth; what it gains, by which it won,
    stays as it was.
    """
    fit = smoothed(along_both(entry.fit))
    return replace(entry, hypothesis=fit.problem.hypothesis, fit=fit)


def along_both(fit: Fit) -> Fit:
    """A law of one axis with its like along the other one beside it, where that pays; any other fit
    as it is.
    """
    law = fit.problem.hypothesis.law
    if law is None or law.location not in AXES:
        return fit
    argument = OTHER.get(law.argument, law.argument)
    like = [
        replace(other, parity=law.parity)
        for other in laws(fit.problem, fit.u)
        if (other.argument, other.acts) == (argument, law.acts) and other.location in AXES
        if other.location != law.location
    ]
    if not like:
        return fit
    both = _of(fit, (law, like[0]), [law_values(fit), np.zeros(len(like[0].knots))])
    return both if rank(both) < rank(fit) - THRESHOLD else fit


def smoothed(fit: Fit) -> Fit:
    """Free-form laws with all knots that there is room for, as smooth as is most probable; any
    other fit, and one that would lose more than noise by it, as it is.
    """
    if fit.problem.hypothesis.law is None:
        return fit
    many = _with_finer_knots(fit)
    stiff = [
        replace(law, stiffness=_most_probable(many, law)) for law in many.problem.hypothesis.laws
    ]
    bent = _of(many, stiff, [law_values(many, law) for law in stiff])
    lost = bent.cost - _prior_of_bending(bent) - many.cost
    return bent if lost < len(law_places(many.problem.unknowns)) else fit


def _with_finer_knots(fit: Fit) -> Fit:
    """The fit of laws with a knot more between any two, while there is room."""
    known = fit.problem.hypothesis.laws
    many = [_fine(law) for law in known]
    values = [
        np.interp(new.knots, law.knots, law_values(fit, law))
        for new, law in zip(many, known, strict=True)
    ]
    return _of(fit, many, values)


def _fine(law: LawShape) -> LawShape:
    twice = finer(law)
    return _fine(twice) if len(twice.knots) <= KNOTS else law


def _of(fit: Fit, shapes: Sequence[LawShape], values: Sequence[Array]) -> Fit:
    """The problem of a fit with these laws, fitted from where that ended and from these values
    (knots,) of each.
    """
    first, *beside = shapes
    hypothesis = Hypothesis(law=first, beside=beside[0] if beside else None)
    problem = replace(fit.problem, hypothesis=hypothesis)
    start = problem.carried(fit.problem, fit.u)
    for law, own in zip(hypothesis.laws, values, strict=True):
        start[law_places(problem.unknowns, law)] = own[law.own] / law.scale
    return minimise(problem, start, ITERATIONS)


def _most_probable(fit: Fit, law: LawShape) -> float:
    """The weight of a law's bending under which the data are most probable."""
    at, bent = law_places(fit.problem.unknowns, law), bending(law)
    known, price = _learnt(fit, at), bent.T @ bent
    free = np.diag(fit.problem.prior[1][at] ** 2)
    weights = RELATIVE * np.trace(known) / np.trace(price)
    return float(max(weights, key=lambda w: _log_evidence(known, free, w * price, fit.u[at])))


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


def _prior_of_bending(fit: Fit) -> float:
    """What bending costs a fit [nats]."""
    bent = [
        law.stiffness * np.sum((bending(law) @ fit.u[law_places(fit.problem.unknowns, law)]) ** 2)
        for law in fit.problem.hypothesis.laws
    ]
    return float(0.5 * sum(bent))
