"""Stamps that scatter about an even clock: rows taken evenly, and stamped when written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.recording.record import ANGLES, Recording

FEWEST = 50  # rows that tell a clock
EVEN, WILD = 1e-3, 0.3  # of a period, by which stamps scatter: an even clock; none at all
WANDER = 0.5  # correlation of one stamp's error with the next above which a clock is uneven itself
SMOOTH = 1e-9  # [rad] of roughness, rms, below which angles stand still
SMOOTHER = 0.5  # share that must be left of how rough the angles are, or the stamps are right

Array = NDArray[np.float64]


def with_even_stamps(recording: Recording) -> tuple[Recording, float]:
    """The recording on the even clock that its stamps scatter about, and by how much they do [s].

    Angles that are commanded change smoothly: where they are rough over the stamps as given, and
    much smoother over an even clock, the rows were taken evenly.  Otherwise the recording itself,
    and 0.
    """
    clock = _clock(recording.time)
    if clock is None:
        return recording, 0.0
    angles = [recording[name] for name in ANGLES if name in recording]
    given, even = (sum(_roughness(t, a) for a in angles) for t in (recording.time, clock))
    if given < SMOOTH**2 * len(clock) or even > SMOOTHER**2 * given:
        return recording, 0.0
    return replace(recording, time=clock), float(np.std(recording.time - clock))


def _clock(time: Array) -> Array | None:
    """The even clock (n,) that stamps (n,) scatter about, rows that lack left out; None without."""
    if len(time) < FEWEST:
        return None
    steps = np.rint(np.diff(time) / np.median(np.diff(time)))
    if steps.min() < 1:  # stamps that scatter by half a period tell no row that lacks
        steps = np.ones(len(steps))
    counts = np.concatenate([[0.0], np.cumsum(steps)])
    period, start = np.polyfit(counts, time, 1)
    off = time - (start + period * counts)
    scatter = float(np.std(off)) / period
    wander = float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-300)
    if not EVEN < scatter < WILD or wander > WANDER:
        return None
    return np.asarray(start + period * counts)


def _roughness(time: Array, values: Array) -> float:
    """Sum of squares of what each value (n,) is off the line between its neighbours."""
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    off = values[1:-1] - (1 - share) * values[:-2] - share * values[2:]
    return float(np.nansum(off**2))
