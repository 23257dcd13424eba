"""Rows that a logger lost: put back, so that commands and loops go on as they did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.recording.record import ANGLES, Recording

MOST = 8  # rows that may lack at one place; a longer hole is a pause of the logger
EVEN = 0.05  # of a period: stamps closer than this to whole periods are those of a clock
FEW = 0.05  # share of holes above which rows are not lost, but written at a pace of their own
STRAIGHT = 1e-3  # change of slope, relative to the largest slope, that bends a line

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


def with_lost_rows(recording: Recording) -> Recording:
    """The recording with the rows that lack in an even clock, at most ``MOST`` at a place.

    Measured channels are blank there.  Commanded angles go on from both sides: two straight lines
    meet where they cross (a corner of the path that lies in the hole), a curve is led through with
    the slopes of its sides.  Voltages are held.  A recording without such rows is returned itself.
    """
    lack = lacking(recording.time)
    holes = np.flatnonzero(lack)
    if not len(holes):
        return recording
    after = np.repeat(holes, lack[holes]) + 1
    parts = np.concatenate([np.arange(1, n + 1) / (n + 1) for n in lack[holes]])
    times = recording.time[after - 1] + parts * np.diff(recording.time)[after - 1]
    channels = {name: np.insert(v, after, np.nan) for name, v in recording.channels.items()}
    for name in ANGLES:
        if name in channels:
            course = _courses(recording.time, recording[name], holes, lack[holes], times)
            channels[name] = np.insert(recording[name], after, course)
    return replace(recording, time=np.insert(recording.time, after, times), channels=channels)


def lacking(time: Array) -> Whole:
    """How many rows lack behind each row but the last, (n - 1,); none where the clock is uneven."""
    steps = np.diff(time) / np.median(np.diff(time))
    whole = np.rint(steps)
    lack = np.where(whole <= MOST + 1, whole - 1, 0).astype(np.int64)
    even = (np.abs(steps - whole) < EVEN) | (steps > MOST + 1)
    sound = even.all() and (whole >= 1).all() and (whole > 1).mean() < FEW
    return lack if sound else np.zeros_like(lack)


def _courses(time: Array, values: Array, holes: Whole, lack: Whole, times: Array) -> Array:
    """A channel (n,) at the times (m,) of all lost rows, ``lack`` of them behind each hole."""
    parts = np.split(times, np.cumsum(lack)[:-1])
    return np.concatenate(
        [_through(time, values, int(a), at) for a, at in zip(holes, parts, strict=True)]
    )


def _through(time: Array, values: Array, a: int, at: Array) -> Array:
    """A channel (n,) at times (k,) between its rows a and a + 1; blank where its sides are not
    known.
    """
    sides = slice(a - 2, a + 4)
    t, v = time[sides], values[sides]
    if a < 2 or len(t) < 6 or not np.isfinite(v).all():
        return np.full(len(at), np.nan)
    slopes = np.diff(v) / np.diff(t)
    first, last = slopes[1], slopes[3]
    bend = np.abs(slopes[[0, 4]] - slopes[[1, 3]])
    if (bend > STRAIGHT * np.abs(slopes).max()).any():
        from scipy.interpolate import CubicHermiteSpline

        ends = [first + (first - slopes[0]) / 2, last + (last - slopes[4]) / 2]
        return np.asarray(CubicHermiteSpline(t[2:4], v[2:4], ends)(at))
    left, right = v[2] + first * (at - t[2]), v[3] + last * (at - t[3])
    cross = t[2] + (v[3] - v[2] - last * (t[3] - t[2])) / (first - last) if first != last else t[2]
    if not t[2] < cross < t[3]:
        return np.interp(at, t[2:4], v[2:4])
    return np.where(at < cross, left, right)
