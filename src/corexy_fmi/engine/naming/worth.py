"""Whether a second effect gains enough: more than a wrong form of the first one may leave it."""

from __future__ import annotations

from dataclasses import replace

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.naming.entries import THRESHOLD, form_floor
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.engine.naming.specification import leftover

SECOND_SHARE = 0.04  # a second effect gains at least this share of the first one's gain
MENDING_SHARE = 0.1  # the same where both leave starkly, and more than half of what one does
COMPLETING = 0.005  # the same where the first one alone is refuted by what it leaves, both are not
WHOLE = 3.0  # standard deviations of what both leave to simple functions, at most
STARK = 10.0  # of what one alone leaves: no wrong form did, whatever share both gain


def pays(one: Fit, two: Fit, base: Fit) -> bool:
    """Whether a second effect gains enough over one: as a wrong form of one may leave a share of it
    to others, either more than that, or what one leaves to simple functions and both do not; any
    gain where that is stark.
    """
    gain, first = rank(one) - rank(two), gained(one, base)
    if gain < max(THRESHOLD + form_floor(two), least(one) * first):
        return False
    return gain > _share(one, two) * first or (leftover(one).matters(0.0) and complete(two))


def _share(one: Fit, two: Fit) -> float:
    """Share of one's gain that a second effect gains at least, whatever both leave."""
    left = leftover(two).score
    mends_little = left > STARK and left > 0.5 * leftover(one).score
    return MENDING_SHARE if mends_little else SECOND_SHARE


def gained(one: Fit, base: Fit) -> float:
    """What one gains over nothing [nats]; both under the ceiling where one is charged for it."""
    if one.problem.noise is not base.problem.ceiling:
        return base.cost - one.cost
    return minimise(replace(base.problem, noise=one.problem.noise), base.u, 0).cost - one.cost


def least(one: Fit) -> float:
    """Share of one's gain that a second effect gains at least."""
    return 0.0 if leftover(one).score > STARK else COMPLETING


def complete(fit: Fit) -> bool:
    """Whether a fit leaves next to nothing to simple functions of the motion."""
    return leftover(fit).score < WHOLE
