"""What sensors and logs make of where the stage was: run, time [s], x and y [m], random -> x, y."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import butter, filtfilt, lfilter

from benchmarks.shop.case import Sensor
from benchmarks.shop.stage import Array

RATE = 500.0  # [1/s] rows of nearly all motions


def added(change: Callable[[int, Array, Array], Array | tuple[Array, Array]]) -> Sensor:
    """What is added to x and y, by run, time and place."""

    def sensor(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
        told = change(n, time, xy)
        return xy + (np.column_stack(told) if isinstance(told, tuple) else told)

    return sensor


def late(delays: tuple[float, float, float], axes: tuple[int, ...] = (0, 1)) -> Sensor:
    """Some axes late, by a time of each run [s]."""

    def sensor(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
        seen = xy.copy()
        for a in axes:
            seen[:, a] = np.interp(time - delays[n], time, xy[:, a])
        return seen

    return sensor


def rounded(step: float, offset: float) -> Sensor:
    """To the counts of an encoder [m]."""
    return lambda n, time, xy, random: np.round((xy + offset) / step) * step


def low_pass(frequency: float, *, both_ways: bool) -> Sensor:
    """Butterworth's filter of second order [Hz]; both ways in time it has no lag."""
    b, a = butter(2, frequency / (RATE / 2))

    def sensor(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
        if both_ways:
            return np.asarray(filtfilt(b, a, xy, axis=0))
        return np.asarray(lfilter(b, a, xy - xy[0], axis=0)) + xy[0]

    return sensor


def held(rows: int) -> Sensor:
    """Every so many rows a new value, repeated in between."""
    return lambda n, time, xy, random: xy[np.arange(len(xy)) // rows * rows]


def exposed(rows: int) -> Sensor:
    """The mean over so many rows about each one."""

    def sensor(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
        padded = np.pad(xy, ((rows // 2, rows - 1 - rows // 2), (0, 0)), "edge")
        weights = np.ones(rows) / rows
        return np.column_stack([np.convolve(padded[:, a], weights, "valid") for a in (0, 1)])

    return sensor


def loose_x(play: float) -> Sensor:
    """The tool follows in x only where its play [m] ends."""

    def sensor(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
        seen = xy.copy()
        for k in range(1, len(xy)):
            low, high = xy[k, 0] - play / 2, xy[k, 0] + play / 2
            seen[k, 0] = min(max(seen[k - 1, 0], low), high)
        return seen

    return sensor


def jittered(ratio: float, jitter: float) -> Sensor:
    """Samples of another clock: taken at t (1 + ratio), off by up to ``jitter`` [s]."""

    def sensor(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
        at = [time * (1 + ratio) + jitter * random.uniform(-1, 1, len(time)) for _ in (0, 1)]
        return np.column_stack([np.interp(at[a], time, xy[:, a]) for a in (0, 1)])

    return sensor


def dirty(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
    """Spikes of 2 mm in x; eight times the sensor stands still."""
    seen, rows = xy.copy(), len(xy)
    spikes = random.choice(rows, rows // 150, replace=False)
    seen[spikes, 0] += random.choice([-1, 1], len(spikes)) * 2e-3
    for k in random.choice(rows - 60, 8, replace=False):
        seen[k : k + random.integers(10, 50)] = seen[k]
    return seen


def swayed(n: int, time: Array, xy: Array) -> tuple[Array, Array]:
    """The table is bumped 5 s into the first run: 6 Hz, dying out."""
    since = np.maximum(time - 5.0, 0.0)
    sway = np.sin(2 * np.pi * 6 * since) * np.exp(-since / 0.6) * (n == 0)
    return 1.5e-4 * sway, 8e-5 * sway


def barrel(n: int, time: Array, xy: Array) -> Array:
    """A lens, its middle off that of the stage."""
    off = xy - np.array([0.01, -0.005])
    return -0.25 * off * (off**2).sum(axis=1)[:, None]


def tilted(slope: float) -> Sensor:
    """A camera whose view tapers along x [1/m]."""
    return added(lambda n, time, xy: xy / (1 + slope * xy[:, :1]) - xy)
