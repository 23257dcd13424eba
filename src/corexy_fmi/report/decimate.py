"""Fewer points, same picture: what a drawing needs of an hour at 1 kHz.

Curves keep the least and the greatest value of each bucket, so no peak is lost; paths keep each
distinct piece once, because a loop drawn a thousand times looks like a loop drawn once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
GAP = 8  # usual distances of samples


@dataclass(frozen=True, eq=False)
class Envelope:
    """A curve in at most a given number of buckets; ``low`` is ``high`` where none was merged."""

    time: Array  # (b,) first time of each bucket
    low: Array  # (b,)
    high: Array  # (b,)

    @property
    def merged(self) -> bool:
        """Whether a bucket holds more than one sample."""
        return self.low is not self.high


def envelope(time: Array, values: Array, buckets: int) -> Envelope:
    """Least and greatest finite value of each of ``buckets`` equal runs of samples."""
    taken = np.isfinite(values)
    if not taken.all():
        time, values = time[taken], values[taken]
    if len(values) <= buckets:
        return Envelope(time, values, values)
    starts = np.linspace(0, len(values), buckets, endpoint=False).astype(np.int64)
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    return Envelope(time[starts], low, high)


def with_gaps(time: Array, *curves: Array) -> tuple[Array, ...]:
    """The same with NaN where samples dropped out for much longer than their usual distance."""
    step = np.diff(time)
    far = GAP * float(np.median(step)) if len(step) else 0.0
    after = 1 + np.flatnonzero(step > far)
    return np.insert(time, after, time[0]), *(np.insert(c, after, np.nan) for c in curves)


def outline(x: Array, y: Array, cells: int = 1200, pieces: int = 6000) -> tuple[Array, Array]:
    """A path as its distinct pieces on a grid of ``cells``, NaN between pieces that do not join."""
    x, y = _taken(x, y)
    if len(x) < 2:
        return x, y
    while True:
        begin, end = _distinct_pieces(x, y, cells)
        if len(begin) <= pieces or cells < 50:
            return _broken_line(x, y, begin[:pieces], end[:pieces])
        cells = cells * 2 // 3


def rms_per_cell(x: Array, y: Array, size: Array, cells: int = 120) -> tuple[Array, Array, Array]:
    """The middle of each cell that the path visits, and the rms of the sizes in it."""
    x, y, size = _taken(x, y, size)
    if not len(size):
        return x, y, size
    pitch = (max(np.ptp(x), np.ptp(y)) or 1.0) / cells
    key = _cell(x, pitch) * (cells + 1) + _cell(y, pitch)
    count, power = np.bincount(key), np.bincount(key, weights=size**2)
    held = np.flatnonzero(count)
    across, up = np.divmod(held, cells + 1)
    return x.min() + across * pitch, y.min() + up * pitch, np.sqrt(power[held] / count[held])


def _taken(*curves: Array) -> tuple[Array, ...]:
    """The samples at which all curves are known."""
    known = np.logical_and.reduce([np.isfinite(curve) for curve in curves])
    return curves if known.all() else tuple(curve[known] for curve in curves)


def _cell(values: Array, pitch: float) -> Rows:
    """Number of the grid line next to each value, counted from the least one."""
    return np.rint((values - values.min()) / pitch).astype(np.int64)


def _distinct_pieces(x: Array, y: Array, cells: int) -> tuple[Rows, Rows]:
    """Rows at which a piece that was not yet drawn begins, and the rows at which it ends."""
    pitch = (max(np.ptp(x), np.ptp(y)) or 1.0) / cells
    key = _cell(x, pitch) * (cells + 1) + _cell(y, pitch)
    rows = np.concatenate(([0], 1 + np.flatnonzero(np.diff(key))))
    if len(rows) < 2:
        return rows[:1], rows[:1]
    pair = key[rows[:-1]] * (cells + 1) ** 2 + key[rows[1:]]
    first = np.sort(np.unique(pair, return_index=True)[1])
    return rows[first], rows[first + 1]


def _broken_line(x: Array, y: Array, begin: Rows, end: Rows) -> tuple[Array, Array]:
    """Pieces one after the other, with a gap wherever the next does not start at the last's end."""
    skip, gap = -1, -2
    apart = np.concatenate((begin[1:] != end[:-1], [True]))
    rows = np.column_stack((begin, np.where(apart, end, skip), np.where(apart, gap, skip))).ravel()
    rows = rows[rows != skip][:-1]
    return np.where(rows >= 0, x[rows], np.nan), np.where(rows >= 0, y[rows], np.nan)


def log_bins(frequency: Array, density: Array, bins: int = 300) -> tuple[Array, Array]:
    """A density averaged (rms) over at most ``bins`` bins that are equal on a logarithmic axis."""
    taken = (frequency > 0) & np.isfinite(density)
    frequency, density = frequency[taken], density[taken]
    if len(frequency) <= bins:
        return frequency, density
    place = np.log(frequency / frequency[0]) / np.log(frequency[-1] / frequency[0]) * (bins - 1e-9)
    starts = np.flatnonzero(np.diff(place.astype(np.int64), prepend=-1))
    count = np.diff(np.append(starts, len(frequency)))
    mean = np.add.reduceat(frequency, starts) / count
    return mean, np.sqrt(np.add.reduceat(density**2, starts) / count)
