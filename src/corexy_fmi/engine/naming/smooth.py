"""A free-form law as it is told: along both axes where that pays, as smooth as its data ask.

Few knots cannot follow a curve, many follow the noise.  So a law gets all that there is room for,
and a prior under which a curve that bends more is less likely; how much less is chosen where the
data are most probable (MacKay, Neural Computation 4(3), 1992, doi:10.1162/neco.1992.4.3.415).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import (
    SPEEDS,
    LawShape,
    bending,
    law_places,
    law_values,
)
from corexy_fmi.engine.fitting.rough import softened
from corexy_fmi.engine.naming.again import with_laws
from corexy_fmi.engine.naming.candidates import finer, laws
from corexy_fmi.engine.naming.entries import THRESHOLD, Competition, Entry
from corexy_fmi.engine.naming.own_times import with_own_times
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.kernel.layout import KNOTS
from corexy_fmi.machine.laws import AXES

LADDER = np.logspace(2.0, -5.0, 8)  # weights of bending, in units of the data's own
BEYOND = 1.05  # times the last knot of a speed, from which on a faster one gets its own
TIED = 3.0  # [nats] within which a force and a friction explain alike
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
    fit = softened(smoothed(along_both(with_own_times(commoner(entry.fit)))))
    return replace(entry, hypothesis=fit.problem.hypothesis, fit=fit)


def commoner(fit: Fit) -> Fit:
    """A force by an axis' own place as a friction, where that explains as much; any other fit as it
    is.  Places that were passed one way alone show no difference, and a rail that is tight
    somewhere is commoner than what pulls there.
    """
    law = fit.problem.hypothesis.law
    if law is None or law.acts != "force" or law.argument != law.location:
        return fit
    like, values = replace(law, acts="friction"), law_values(fit)
    friction = min((with_laws(fit, [like], [s * values]) for s in (-1.0, 1.0)), key=rank)
    return friction if rank(friction) < rank(fit) + TIED else fit


def along_both(fit: Fit) -> Fit:
    """A law of one axis with its like along the other one beside it, begun at nothing or, but for
    places, as the law itself, where that pays; any other fit as it is.
    """
    law = fit.problem.hypothesis.law
    if law is None or law.location not in AXES:
        return fit
    argument = OTHER.get(law.argument, law.argument)
    like = [
        _like(law, other)
        for other in laws(fit.problem, fit.u)
        if (other.argument, other.acts) == (argument, law.acts) and other.location in AXES
        if other.location != law.location
    ]
    if not like:
        return fit
    own, begun = law_values(fit), np.interp(like[0].knots, law.knots, law_values(fit))
    starts = [0 * begun] if law.argument in AXES else [0 * begun, begun]
    both = min((with_laws(fit, (law, like[0]), [own, values]) for values in starts), key=rank)
    return both if rank(both) < rank(fit) - THRESHOLD else fit


def _like(law: LawShape, other: LawShape) -> LawShape:
    """The other axis' law made like a law; with the same times, where it has its own."""
    like = replace(other, parity=law.parity)
    if not law.since:
        return like
    return replace(like, knots=law.knots, since=law.since, fastest=law.fastest)


def smoothed(fit: Fit) -> Fit:
    """The most probable of free-form laws as they are and laws on all knots that there is room for,
    held straight at first, then less and less; any other fit as it is.

    Begun with wiggles a law keeps them: they stand in for nominal parameters that are off.
    """
    if fit.problem.hypothesis.law is None:
        return fit
    last, best = _with_finer_knots(fit), replace(fit, slopes=None)
    units, most = [_unit(last, law) for law in last.problem.hypothesis.laws], log_evidence(best)
    for share in LADDER:  # of fits on the way none is kept: a long recording's has a large Jacobian
        last = _held(last, [share * unit for unit in units])
        told = log_evidence(last)
        best, most = (last, told) if told > most else (best, most)
    return best


def log_evidence(fit: Fit) -> float:
    """Log probability [nats] of the data under the laws of a fit, whatever their values (Laplace);
    but for what no law changes.
    """
    problem = fit.problem
    if not np.isfinite(fit.cost):
        return -np.inf
    at = [k for law in problem.hypothesis.laws for k in law_places(problem.unknowns, law)]
    prior = problem.root[np.ix_(at, at)]
    volume = np.linalg.slogdet(fit.jacobian.T @ fit.jacobian)[1]
    return float(-fit.cost - 0.5 * volume + np.linalg.slogdet(prior)[1])


def _with_finer_knots(fit: Fit) -> Fit:
    """The fit of laws with a knot more between any two, while there is room; over a speed they
    reach to the fastest, which few samples show and a drag tells most of.
    """
    known = fit.problem.hypothesis.laws
    many = [_to_the_fastest(fit, _fine(law)) for law in known]
    values = [
        np.interp(new.knots, law.knots, law_values(fit, law))
        for new, law in zip(many, known, strict=True)
    ]
    return with_laws(fit, many, values)


def _held(fit: Fit, stiffness: Sequence[float]) -> Fit:
    """The fit of laws once more, each held straight so strongly."""
    known = fit.problem.hypothesis.laws
    held = [replace(k, stiffness=float(s)) for k, s in zip(known, stiffness, strict=True)]
    return with_laws(fit, held, [law_values(fit, law) for law in known])


def _fine(law: LawShape) -> LawShape:
    twice = finer(law)
    return _fine(twice) if len(twice.knots) <= KNOTS else law


def _to_the_fastest(fit: Fit, law: LawShape) -> LawShape:
    """A law with knots more up to the fastest speed either way, as far apart as its last ones where
    there is room, if its knots end before.
    """
    room, last = (KNOTS - len(law.knots)) // 2, law.knots[-1]
    if law.argument not in SPEEDS or not room:
        return law
    runs = range(len(fit.problem.runs))
    seen = [fit.problem.simulate(fit.u[None], r, (law.argument,))[0] for r in runs]
    top = max(float(np.abs(speed).max()) for speed in seen)
    if top < BEYOND * last:
        return law
    count = min(room, int(np.ceil((top - last) / (last - law.knots[-2]))))
    more = np.linspace(last, top, count + 1)[1:]
    return replace(law, knots=(*(-more[::-1]).tolist(), *law.knots, *more.tolist()))


def _unit(fit: Fit, law: LawShape) -> float:
    """The weight of a law's bending that tells as much of its values as the data do."""
    own = fit.jacobian[:, law_places(fit.problem.unknowns, law)]
    return float(np.sum(own**2) / max(np.sum(bending(law) ** 2), 1e-300))
