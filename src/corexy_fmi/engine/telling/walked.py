"""Walked intervals: of what a recording bounds on one side only, as far as the likelihood lets it.

An inertia on stiff guides shows while its mode is slow; below that any will do, and a fit ends
wherever its way led.  The curvature there tells of a ripple, not of the data; nor does it where a
fit ends at the least that is allowed, as a rotor without damping, and the likelihood bends on the
first bit of it.  So what is fitted on a logarithmic scale and is not well known, or ends there, is
held further and further off, all else fitted to it, until that costs what ends a 95 % interval.

Source: profile likelihood, Raue et al. 2009, doi:10.1093/bioinformatics/btp358.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.looser import loosened
from corexy_fmi.engine.fitting.unknowns import Unknown
from corexy_fmi.engine.judging.model import Ends, ends
from corexy_fmi.engine.naming.forms import UNTOLD
from corexy_fmi.engine.naming.whole import held

WIDE = 0.25  # half width of an interval, of a logarithm, from which on it is walked
LEAST = 0.1  # of an interval's upper half: as near is at the least that is allowed


def further(fit: Fit, mapper: Mapper) -> Sequence[Mapping[str, Ends]]:
    """What else intervals reach to, by key: under looser priors, and as walked."""
    if not fit.problem.hypothesis.uses:
        return []
    loose = loosened(fit)
    return [*([ends(loose)] if loose else []), walked(fit, mapper)]


def walked(fit: Fit, mapper: Mapper) -> dict[str, Ends]:
    """Ends, on the internal scale, of the intervals that are not well known by curvature."""
    linear = ends(fit)
    unknowns = enumerate(fit.problem.unknowns)
    doubtful = [k for k, x in unknowns if _doubtful(x, linear[x.key], float(fit.u[k]))]
    keys = [fit.problem.keys[k] for k in doubtful]
    sides = [(k, end) for k, key in zip(doubtful, keys, strict=True) for end in linear[key]]
    found = list(mapper(partial(_end, fit), sides))
    return dict(zip(keys, zip(found[::2], found[1::2], strict=True), strict=True))


def _doubtful(unknown: Unknown, linear: Ends, middle: float) -> bool:
    """Whether an effect's parameter has a wide interval that ends within what is allowed, or is at
    the least of it.
    """
    (low, high), (least, most) = linear, unknown.range()
    if "." not in unknown.key or (low <= least and high >= most):
        return False
    if unknown.log:
        return high - low > 2 * WIDE
    return not unknown.span and middle - least < LEAST * (high - middle)


def _end(fit: Fit, side: tuple[int, float]) -> float:
    """Where an interval ends, walked from its linear end until that costs too much or no more is
    allowed.  What breaks down, too stiff for the micro-step, may be.
    """
    k, linear = side
    unknown, middle = fit.problem.unknowns[k], float(fit.u[k])
    last = unknown.range()[linear > middle]
    there, least, before, risen = fit, fit.cost, middle, 0.0
    for at in _stations(middle, linear, last):
        there = held(there, {unknown.key: float(unknown.value(at))})
        if not math.isfinite(there.cost):
            return last
        least = min(least, there.cost)
        if (rise := there.cost - least) > UNTOLD:
            roots = [math.sqrt(cost) for cost in (risen, UNTOLD, rise)]
            return before + (at - before) * (roots[1] - roots[0]) / (roots[2] - roots[0])
        before, risen = at, rise
    return last


def _stations(middle: float, first: float, last: float) -> Iterator[float]:
    """From first on, twice as far from the middle each time, and last."""
    step = first - middle
    while abs(step) < abs(last - middle):
        yield middle + step
        step *= 2
    if abs(first - middle) < abs(last - middle):
        yield last
