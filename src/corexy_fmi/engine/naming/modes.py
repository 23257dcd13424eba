"""At which frequencies something may swing: read off what the retuned machine leaves.

A mass on a spring answers every change of speed, so that what it leaves in x and y is near its own
swing under the path's accelerations: one regression for each frequency, and no run of the kernel.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.naming.beyond import Beyond, beyond, gain_many
from corexy_fmi.kernel.call import Array

FREQUENCIES = tuple(np.geomspace(2.0, 120.0, 80))  # [Hz], as far apart as such a mode is wide
NARROW = 0.02  # damping ratio of what is looked for
KEPT, SHOWS = 3, 6.0  # modes that are told; [nats] that each gains at least
TOGETHER = 8  # frequencies at once, to spare memory
RATES = {"": 0, "v": 1, "a": 2}  # of a channel's name before its axis: derivatives of a place


def swing(values: Array, time: Array, frequency: float, damping_ratio: float) -> Array:
    """Where a mass on a damped spring comes to under these accelerations (rows,)."""
    dt, w = float(np.median(np.diff(time))), 2 * np.pi * frequency
    decay, turn = np.exp(-damping_ratio * w * dt), np.cos(w * np.sqrt(1 - damping_ratio**2) * dt)
    poles = [1.0, -2 * decay * turn, decay**2]
    return np.asarray(lfilter([0.0, sum(poles) / w**2], poles, values))


def modes(fit: Fit) -> tuple[float, ...]:
    """Frequencies [Hz] at which a swing explains most of what a fit leaves, the most first."""
    behind, pushed = beyond(fit), _pushed(fit)
    parts = [FREQUENCIES[n : n + TOGETHER] for n in range(0, len(FREQUENCIES), TOGETHER)]
    gains = [gain for part in parts for gain in _gains(behind, pushed, part)]
    inner = range(1, len(gains) - 1)
    tops = [n for n in inner if gains[n - 1] < gains[n] >= gains[n + 1] and gains[n] > SHOWS]
    return tuple(FREQUENCIES[n] for n in sorted(tops, key=lambda n: -gains[n])[:KEPT])


def _gains(
    behind: Beyond, pushed: list[dict[str, Array]], frequencies: tuple[float, ...]
) -> list[float]:
    """Gain [nats] of a swing at each frequency, of any size in each channel."""
    swings = [_swings(behind.fit, pushed, f) for f in frequencies]
    products, gram = behind.of(np.concatenate(swings))
    count = len(swings[0])
    parts = [slice(n * count, (n + 1) * count) for n in range(len(swings))]
    return [gain_many(products[p], gram[p, p])[0] if count else 0.0 for p in parts]


def _pushed(fit: Fit) -> list[dict[str, Array]]:
    """Acceleration [m/s^2] (rows,) of each axis in every run."""
    names, found = ("x_true", "y_true"), []
    for r, run in enumerate(fit.problem.runs):
        time = run.excitation.time
        path = fit.problem.simulate(fit.u[None], r, names)[0]
        found.append({a: _rate(_rate(q, time), time) for a, q in zip("xy", path, strict=True)})
    return found


def _rate(values: Array, time: Array) -> Array:
    return np.asarray(np.gradient(values, time))


def _swings(fit: Fit, pushed: list[dict[str, Array]], frequency: float) -> Array:
    """The swing of each axis as each of its channels would show it, whitened and of unit length,
    (channels, samples).
    """
    channels = sorted({s.channel for run in fit.problem.runs for s in run.samples})
    shown = [c for c in channels if c[-1] in "xy" and c[:-1] in RATES]
    found, at = np.zeros((len(shown), fit.problem.parts[-1].stop)), 0
    for run, filters, axes in zip(fit.problem.runs, fit.problem.filters, pushed, strict=True):
        time = run.excitation.time
        for f in filters:
            channel, width = f.samples.channel, f.count
            if channel in shown:
                moved = swing(axes[channel[-1]], time, frequency, NARROW)
                for _ in range(RATES[channel[:-1]]):
                    moved = _rate(moved, time)
                row = f.white(moved[None, f.samples.rows])[0]
                found[shown.index(channel), at : at + width] = row
            at += width
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300)
