"""Which corner to show from near: the one where the retuned model misses most."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.engine.evidence import Array, Trace
from corexy_fmi.report.figures import mismatch

TURN = np.cos(np.radians(25))  # a corner turns by more
PASS = 2.2  # one pass is drawn as far as this many half sides from the middle
LAG = 0.5  # [s] after the command within which the stage comes to the corner


@dataclass(frozen=True, eq=False)
class Window:
    """A square of the plane and the rows of one pass through it."""

    x: float  # [m], its middle
    y: float
    half: float  # [m], half of a side
    rows: slice


def distance(trace: Trace, model: str) -> Array:
    """Distance [m] of measured and simulated position at the same time; NaN where not measured."""
    off = [mismatch(trace, channel, model) for channel in "xy"]
    if off[0] is None or off[1] is None:
        return np.full(len(trace.time), np.nan)
    return np.hypot(off[0], off[1])


def corner_window(trace: Trace) -> Window | None:
    """A square around the worst corner, else around the worst place of a path without corners."""
    miss = np.nan_to_num(distance(trace, "retuned"))
    known = np.isfinite(trace.x_ref) & np.isfinite(trace.y_ref)
    if not miss.any() or not known.all():
        return None
    corners = _corners(trace.x_ref, trace.y_ref)
    row = int(np.argmax(miss))
    if len(corners):
        reach = max(len(miss) // 400, 5)
        around = [miss[max(c - reach, 0) : c + reach].max() for c in corners]
        row = int(corners[int(np.argmax(around))])
    return _window(trace, row)


def _corners(x: Array, y: Array) -> NDArray[np.int64]:
    """Rows at which the commanded path turns by more than 25 degrees, at most some hundred."""
    way = np.column_stack((np.diff(x), np.diff(y)))
    step = np.hypot(way[:, 0], way[:, 1])
    moving = np.flatnonzero(step > 1e-3 * step.max(initial=0.0))
    way = way[moving] / step[moving, None]
    sharp = moving[1:][np.einsum("ij,ij->i", way[1:], way[:-1]) < TURN]
    return sharp[:: max(len(sharp) // 400, 1)]


def _window(trace: Trace, row: int) -> Window:
    """A square that holds the miss of this pass, and the rows of the pass."""
    x, y = float(trace.x_ref[row]), float(trace.y_ref[row])
    off = np.hypot(trace.x_ref - x, trace.y_ref - y)
    follower = _distance_from(trace.retuned, x, y)
    late = int(np.searchsorted(trace.time, trace.time[row] + LAG)) + 1
    closest = row + int(np.argmin(follower[row:late]))
    miss = np.nan_to_num(distance(trace, "retuned")[max(row - 200, 0) : closest + 200])
    extent = max(float(np.ptp(trace.x_ref)), float(np.ptp(trace.y_ref)), 1e-6)
    size = max(4 * float(miss.max(initial=0.0)), 3 * float(follower[closest]), 1e-5)
    half = min(size, 0.25 * extent)
    before = np.flatnonzero(off[:row] > PASS * half)
    after = np.flatnonzero(follower[closest:] > PASS * half)
    begin = int(before[-1]) if len(before) else 0
    end = closest + int(after[0]) + 1 if len(after) else len(off)
    return Window(x, y, half, slice(begin, end))


def _distance_from(curves: Mapping[str, Array], x: float, y: float) -> Array:
    """Distance [m] of a simulated path from a point; far away where it is not known."""
    return np.nan_to_num(np.hypot(curves["x"] - x, curves["y"] - y), nan=np.inf)
