"""Loops: where the commanded motion repeats, and which samples of each loop belong together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from corexy_fmi.kernel.call import Array, Excitation

ALIKE, SAME = 0.7, 2e-3  # correlation of rates; share of the range that a repeat may be off
TRIED, WHOLE, MOVING = 24, 0.95, 0.05  # lags; share of the best stretch, and of the range
SHORTEST, FEWEST = 0.2, 3  # [s] of a loop; loops
GRID = 20_000  # instants at which the command is compared
FEW = 10  # samples of one loop


@dataclass(frozen=True)
class Loops:
    """``count`` repeats of ``period`` [s] from ``start`` [s] on."""

    start: float
    period: float
    count: int


def find_loops(e: Excitation) -> Loops | None:
    """The repeats of a commanded motion; None where there are fewer than three, or voltages
    drive it.
    """
    moved = np.flatnonzero((np.diff(e.input1) != 0) | (np.diff(e.input2) != 0))
    if e.mode == "voltages" or len(moved) < 10:
        return None
    rows = slice(int(moved[0]), int(moved[-1]) + 2)
    time = e.time[rows]
    grid = np.linspace(time[0], time[-1], min(GRID, len(time)))
    place = np.array([np.interp(grid, time, u[rows]) for u in (e.input1, e.input2)])
    step = float(grid[1] - grid[0])
    found = [_stretch(place, lag) for lag in _lags(np.diff(place, axis=1), SHORTEST / step)]
    found = [f for f in found if f[2] >= FEWEST]
    if not found:
        return None
    most = max(lag * count for lag, _, count in found)
    lag, first, count = next(f for f in found if f[0] * f[2] > WHOLE * most)
    return Loops(float(grid[first]), step * _exactly(place[:, first:], lag, count), count)


def _lags(rate: Array, least: float) -> list[int]:
    """Lags, shortest first, at which rates (2, n) look alike: peaks of their autocorrelation."""
    rows = rate.shape[1]
    power = np.abs(np.fft.rfft(rate, 2 * rows)) ** 2
    alike = np.fft.irfft(power.sum(axis=0))[: rows * (FEWEST - 1) // FEWEST + 2]
    alike /= alike[0] * (1 - np.arange(len(alike)) / rows)
    middle = alike[1:-1]
    tops = 1 + np.flatnonzero((middle >= alike[:-2]) & (middle > alike[2:]) & (middle > ALIKE))
    tops = tops[tops > max(least, 2)]
    best = tops[np.argsort(-alike[tops], kind="stable")[:TRIED]]
    return sorted(int(k) for k in best)


def _stretch(place: Array, lag: int) -> tuple[int, int, int]:
    """The lag, where the longest stretch begins in which places (2, n) repeat, and its loops."""
    far = SAME * float(np.ptp(place, axis=1).max()) + float(np.abs(np.diff(place, axis=1)).max())
    off = np.abs(place[:, lag:] - place[:, :-lag]).max(axis=0) > far
    first, last = _longest(~off)
    still = np.ptp(place[:, first : first + lag], axis=1).max() < MOVING * np.ptp(place)
    return lag, first, 0 if still else int((last - first) / lag + 1e-3) + 1


def _exactly(place: Array, lag: int, count: int) -> float:
    """The lag to a fraction of an instant, from the last whole loop beside the first."""
    loops = min(count, (place.shape[1] - 1) // lag) - 1
    reach = range(max(loops * (lag - 1), 1), loops * (lag + 1) + 1)
    size = min(lag, place.shape[1] - reach[-1])
    if loops < 1 or size < 2:
        return float(lag)
    cost = [float(np.mean((place[:, k : k + size] - place[:, :size]) ** 2)) for k in reach]
    return reach[int(np.argmin(cost))] / loops


def _longest(true: np.ndarray) -> tuple[int, int]:
    """First and last + 1 of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, true, False].astype(np.int8)))
    if not len(edges):
        return 0, 0
    starts, ends = edges[::2], edges[1::2]
    k = int(np.argmax(ends - starts))
    return int(starts[k]), int(ends[k])


def looped_rows(time: Array, loops: Loops) -> np.ndarray | None:
    """Which sample is taken at the same place of each loop, (loops, n); ``time`` (m,) [s] of the
    samples; None where too few loops, or samples of one, are whole.
    """
    end = loops.start + loops.count * loops.period
    whole = int((min(time[-1], end) - loops.start) / loops.period + 1e-3)
    step = float(np.median(np.diff(time)))
    phase = np.arange(0.0, loops.period - step / 2, step)
    if whole < FEWEST or len(phase) < FEW:
        return None
    at = loops.start + loops.period * np.arange(whole)[:, None] + phase
    return np.clip(np.searchsorted(time, at - step / 2), 0, len(time) - 1)
