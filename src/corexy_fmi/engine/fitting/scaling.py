"""Scaling: no motion tells a common factor of all masses, forces and stiffnesses; priors alone do.

The equations of motion are homogeneous in them (eq. 4 to 7, and every law whose size is a force).
A Jacobian by finite differences does not know that: the rounding of its columns adds up to a false
certainty, which holds a fit where it began.  So one more difference is taken, along this direction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from corexy_fmi.engine.fitting.unknowns import Unknown
from corexy_fmi.kernel.call import Array

TINY, UNSEEN = 1e-6, 0.01  # log of a factor; share of the priors' information that is nothing


def grown(unknowns: Sequence[Unknown], u: Array, log_factor: float) -> Array:
    """u (size,) with every mass, force and stiffness exp(``log_factor``) times as large."""
    result = u.copy()
    for k, x in enumerate(unknowns):
        if x.force and x.log:
            result[k] += log_factor
        elif x.force:
            result[k] += ((x.centre + x.held) / x.scale + u[k]) * np.expm1(log_factor)
    return result


def along(unknowns: Sequence[Unknown], u: Array, limits: tuple[Array, Array], step: float) -> Array:
    """Change of u (size,) by a small common factor; what stands at a limit stays."""
    moved = grown(unknowns, u, step)
    low, high = limits
    free = (moved < high) & (moved > low) & (u > low)
    return np.where(free, moved - u, 0.0)


def agree(slopes: Array, move: Array, change: Array) -> None:
    """Correct slopes (size, samples), so that ``move`` (size,) makes ``change`` (samples,).

    Each in proportion to its power: the relative rounding of all is taken as equal.
    """
    moved = np.flatnonzero(move)
    weight = {k: float(move[k] * (slopes[k] @ slopes[k])) for k in moved}
    total = sum(float(move[k]) * w for k, w in weight.items())
    gap = change - move @ slopes
    if not (total > 0 and np.isfinite(gap).all()):
        return
    for k in moved:
        slopes[k] += weight[k] / total * gap


def _direction(unknowns: Sequence[Unknown], u: Array) -> Array:
    """What u (size,) changes by, for each unit of the common factor's logarithm."""
    return (grown(unknowns, u, TINY) - u) / TINY


def unseen(unknowns: Sequence[Unknown], u: Array, slopes: Array, precision: Array) -> bool:
    """Whether slopes (samples, size) tell next to nothing of the common factor beside priors."""
    move = _direction(unknowns, u)
    told, held = np.sum((slopes @ move) ** 2), np.sum((move * precision) ** 2)
    return bool(told < UNSEEN * held)


def eased(unknowns: Sequence[Unknown], u: Array, precision: Array) -> Array:
    """u (size,) with the common factor that its priors like best; ``precision`` is 1 / std."""
    move = _direction(unknowns, u)
    held = float(np.sum((move * precision) ** 2))
    pull = float(np.sum(move * u * precision**2))
    return grown(unknowns, u, -pull / held) if held > 0 else u
