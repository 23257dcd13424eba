"""Samples that were not taken: of a sensor that froze, or a slow one whose last value came again.

Such a value comes again to its last digit, and jumps to where the stage has gone meanwhile once the
sensor goes on.  A stage that sticks shows the former, not the latter; a coarse sensor's steps come
again by themselves.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.kernel.call import Array

SHORTEST, OFTEN = 3, 0.2  # rows of a hold; share of repeats from which two are one
LEAST, MOST = 3, 0.3  # holds in motion that tell; share of those that need not end in a jump
NEAR = 0.5  # share of the way meanwhile by which a jump may miss it
FINE = 0.05  # of the usual change: the least ones of a sensor whose steps are none


def repeats(values: Array, course: Array) -> np.ndarray:
    """True (n,) where a channel (n,) only repeats the sample before; its predicted course (n,)
    tells where the stage went meanwhile.  All False where nothing was held.
    """
    rows = np.flatnonzero(np.isfinite(values))
    seen, went, found = values[rows], course[rows], np.zeros(len(values), dtype=bool)
    same = np.diff(seen, prepend=np.nan) == 0
    if not same.any() or _coarse(seen):
        return found
    first = np.flatnonzero(~same)
    length = np.diff(first, append=len(seen))
    least = 2 if same.mean() > OFTEN else SHORTEST
    held = length >= least
    if not _jumps(seen, went, first[held], length[held]):
        return found
    found[rows] = same & np.repeat(held, length)
    return found


def _coarse(seen: Array) -> bool:
    """Whether changes (n - 1,) come in steps."""
    changes = np.abs(np.diff(seen))
    changes = changes[changes > 0]
    return len(changes) == 0 or bool(np.quantile(changes, 0.01) > FINE * np.median(changes))


def _jumps(seen: Array, went: Array, first: np.ndarray, length: np.ndarray) -> bool:
    """Whether holds that begin at rows (m,) and are so long end where the stage has gone."""
    ended = first + length < len(seen)
    begin, end = first[ended], (first + length)[ended]
    way, jump = went[end] - went[begin], seen[end] - seen[begin]
    changes = np.abs(np.diff(seen))
    moved = np.abs(way) > np.median(changes[changes > 0])
    met = np.abs(jump - way) < NEAR * np.abs(way)
    return moved.sum() >= LEAST and bool(met[moved].mean() > 1 - MOST)
