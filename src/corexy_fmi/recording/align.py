"""How far two clocks are apart: cross-correlation of what both saw of one motion.

An event at time t of the first clock stands at t + offset + drift t of the second.  Both come from
the lags of windows near the one of the whole, their standard errors from the scatter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError

Array = NDArray[np.float64]
FINEST = 2e-4  # [s] grid
SMOOTH = 4e-3  # [s] both signals are smoothed by, at least
ALIKE = 0.3  # correlation from which on two signals are of one motion
RIVAL = 0.97  # share of the best correlation that a second offset may reach
WINDOWS, LOCAL, NEARBY, SURE = 10, 1.0, 0.1, 0.6  # count, shortest [s], reach [s], correlation


@dataclass(frozen=True)
class Clocks:
    """``offset`` [s] and ``drift`` [1] of the second clock with standard errors; NaN: unknown."""

    offset: float
    drift: float
    offset_std: float
    drift_std: float

    def on_first(self, time: Array) -> Array:
        """Times (n,) [s] of the second clock on the first."""
        return (time - self.offset) / (1 + self.drift)

    @property
    def line(self) -> str:
        """For a recording's metadata."""
        return (
            f"offset={self.offset:.6g}+-{self.offset_std:.2g} s "
            f"drift={1e6 * self.drift:.4g}+-{1e6 * self.drift_std:.2g} ppm"
        )


@dataclass(frozen=True, eq=False)
class Signal:
    """Values (n, k) over times (n,) [s]: speeds or accelerations, zero where nothing moves."""

    time: Array
    values: Array


def best_lag(first: Signal, second: Signal, what: str) -> float:
    """Offset [s] at which the second signal resembles the first most.

    ``what`` names the pair.  Raises InputError where nothing is alike, or two offsets are.
    """
    step = _step(first, second)
    lags, alike = _correlation(first, second, step)
    best = int(np.argmax(alike))
    if not alike[best] > ALIKE:
        raise InputError(
            f"{what}: they resemble each other by {max(alike[best], 0):.2f} at best, expected more "
            f"than {ALIKE}: are they of one motion?"
        )
    falls = np.flatnonzero(alike < 0.5 * alike[best])
    left, right = falls[falls < best], falls[falls > best]
    inside = slice(left[-1] if len(left) else 0, (right[0] if len(right) else len(alike)) + 1)
    others = alike.copy()
    others[inside] = 0.0
    rival = int(np.argmax(others))
    if others[rival] > RIVAL * alike[best]:
        raise InputError(
            f"{what}: offsets of {lags[best]:.3f} s and {lags[rival]:.3f} s fit alike, expected a "
            "motion that does not repeat"
        )
    return _peak(lags, alike, best)


def clocks(first: Signal, second: Signal, what: str) -> Clocks:
    """Offset and drift of the second clock; raises InputError as `best_lag`."""
    offset = best_lag(first, second, what)
    places, lags = _window_lags(first, second, offset)
    if len(places) < 4:
        return Clocks(offset, 0.0, _step(first, second), float("nan"))
    basis = np.column_stack([np.ones(len(places)), places - places.mean()])
    found, _, _, _ = np.linalg.lstsq(basis, lags, rcond=None)
    scatter = np.sum((lags - basis @ found) ** 2) / (len(places) - 2)
    covariance = scatter * np.linalg.inv(basis.T @ basis)
    at_zero = np.array([1.0, -places.mean()])
    return Clocks(
        float(at_zero @ found),
        float(found[1]),
        float(np.sqrt(at_zero @ covariance @ at_zero)),
        float(np.sqrt(covariance[1, 1])),
    )


def _step(first: Signal, second: Signal) -> float:
    """Grid [s] on which both are compared."""
    return max(FINEST, min(float(np.median(np.diff(s.time))) for s in (first, second)))


def _grid(signal: Signal, step: float, smooth: float) -> tuple[float, Array]:
    """Begin [s] and smoothed values (n, k) on a grid."""
    from scipy.ndimage import gaussian_filter1d  # here: half a second that few commands need

    begin = float(signal.time[0])
    time = np.arange(begin, signal.time[-1], step)
    values = [np.interp(time, signal.time, column) for column in signal.values.T]
    smoothed = gaussian_filter1d(np.array(values), smooth / step, axis=1, mode="constant")
    return begin, smoothed.T


def _correlation(first: Signal, second: Signal, step: float) -> tuple[Array, Array]:
    """Lags [s] and how much the signals are alike at each, 1 for equal ones."""
    from scipy.signal import correlate, correlation_lags  # here: as above

    coarse = max(float(np.median(np.diff(s.time))) for s in (first, second))
    smooth = max(SMOOTH, coarse)
    (begin, a), (other, b) = (_grid(s, step, smooth) for s in (first, second))
    largest = [float(np.abs(v).max(initial=0.0)) or 1.0 for v in (a, b)]
    a, b = a / largest[0], b / largest[1]  # whatever their units, their squares are finite
    size = np.sqrt(np.sum(a**2) * np.sum(b**2))
    both = zip(a.T, b.T, strict=True)
    total = np.sum([correlate(y, x, mode="full", method="fft") for x, y in both], axis=0)
    lags = correlation_lags(len(b), len(a)) * step + other - begin
    return lags, total / size if size > 0 else np.zeros(len(lags))


def _peak(lags: Array, alike: Array, best: int) -> float:
    """The top of the parabola through three points [s]."""
    if not 0 < best < len(lags) - 1:
        return float(lags[best])
    low, top, high = alike[best - 1 : best + 2]
    bend = low - 2 * top + high
    return float(lags[best] + (0.5 * (low - high) / bend if bend else 0.0) * (lags[1] - lags[0]))


def _window_lags(first: Signal, second: Signal, offset: float) -> tuple[Array, Array]:
    """Middles of windows [s] on the first clock, and the lag of each [s], where it is sure."""
    begin, end = first.time[0], first.time[-1]
    count = int(min(WINDOWS, max(1, (end - begin) / LOCAL)))
    step, places, found = _step(first, second), [], []
    for low, high in zip(
        *(np.linspace(begin, end, count + 1)[k:][:count] for k in (0, 1)), strict=True
    ):
        here = _part(first, low, high)
        there = _part(second, low + offset - NEARBY, high + offset + NEARBY)
        if here is None or there is None:
            continue
        lags, alike = _correlation(here, there, step)
        alike = np.where(np.abs(lags - offset) <= NEARBY, alike, 0.0)
        best = int(np.argmax(alike))
        if alike[best] > SURE:
            places.append((low + high) / 2)
            found.append(_peak(lags, alike, best))
    return np.array(places), np.array(found)


def _part(signal: Signal, low: float, high: float) -> Signal | None:
    """What lies between two times; None where that is next to nothing."""
    inside = (signal.time >= low) & (signal.time <= high)
    if np.count_nonzero(inside) < 20:
        return None
    return Signal(signal.time[inside], signal.values[inside])
