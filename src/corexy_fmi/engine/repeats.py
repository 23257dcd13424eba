"""Loops: where the commanded motion repeats, what repeats of the mismatch is no noise.

The difference of the same place of two loops holds noise and drift alone, whatever the model lacks:
its size over sqrt(2) is the noise, its correlation the noise's colour.  What changes from loop to
loop has a shape of its own: an offset that jumps (missed steps, slip) or creeps, a lag that grows
(a clock), a mismatch that fades or grows (warm-up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from corexy_fmi.engine.noise import Noise, estimate
from corexy_fmi.engine.prove import Proof, Replay
from corexy_fmi.engine.quiet import LOUDER, SURE, independent, significance
from corexy_fmi.engine.samples import Run
from corexy_fmi.kernel.call import Array

ALIKE, SAME = 0.7, 2e-3  # correlation of rates; share of the range that a repeat may be off
TRIED, WHOLE, MOVING = 24, 0.95, 0.05  # lags; share of the best stretch, and of the range
SHORTEST, FEWEST = 0.2, 3  # [s] of a loop; loops
GRID = 20_000  # instants at which the command is compared
STEP = 0.03  # share of what it explains that one step must explain beyond a trend
SURELY, CLEARER = 5.0, 1.03  # standard errors of a drift; times what a simpler shape explains


@dataclass(frozen=True)
class Loops:
    """``count`` repeats of ``period`` [s] from ``start`` [s] on."""

    start: float
    period: float
    count: int


@dataclass(frozen=True, eq=False)
class Repeated:
    """What the loops of one channel show: its noise, and the drift in words, "" for none.

    ``size`` is the drift from the first loop to the last [m, or s for a lag, or a share];
    ``at`` [s] the time of a jump.
    """

    loops: Loops
    channel: str
    noise: Noise
    ratio: float
    sure: float
    drift: str
    size: float
    at: float | None


def find_loops(run: Run) -> Loops | None:
    """The repeats of a run's commanded motion; None where there are fewer than three, or voltages
    drive it.
    """
    e = run.excitation
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


def repeated(proof: Proof) -> list[tuple[str, Repeated]]:
    """For each training run with loops what its channels show, after the retuned machine."""
    found = []
    for replayed in proof.replays["retuned"]:
        loops = find_loops(replayed.run) if replayed.run.role == "train" else None
        for c in range(len(replayed.run.samples) if loops else 0):
            told = _channel(replayed, c, loops)
            if told is not None:
                found.append((replayed.run.name, told))
    return found


def _channel(replayed: Replay, channel: int, loops: Loops | None) -> Repeated | None:
    """What one channel shows over its whole loops; None where it has too few samples."""
    samples = replayed.run.samples[channel]
    time = replayed.run.excitation.time[samples.index]
    end = loops.start + loops.count * loops.period if loops else -np.inf
    whole = int((min(time[-1], end) - loops.start) / loops.period + 1e-3) if loops else 0
    if loops is None or whole < FEWEST:
        return None
    step = float(np.median(np.diff(time)))
    phase = np.arange(0.0, loops.period - step / 2, step)
    if len(phase) < 10:
        return None
    at = loops.start + loops.period * np.arange(whole)[:, None] + phase
    near = np.clip(np.searchsorted(time, at - step / 2), 0, len(time) - 1)
    errors = replayed.errors[channel][near]  # (loops, samples of one)
    noise, differences = _noise(errors)
    used = errors.ravel()
    ratio = float(np.sqrt(np.mean((used - used.mean()) ** 2)) / max(noise.marginal, 1e-15))
    sure = significance(ratio, independent(used - used.mean()), independent(differences))
    moved = np.gradient(samples.value[near].mean(axis=0), step)
    drift, size, loop = _drift(errors, moved, noise)
    jump = None if loop is None else loops.start + loop * loops.period
    held = Loops(loops.start, loops.period, whole)
    return Repeated(held, samples.channel, noise, ratio, sure, drift, size, jump)


def _noise(errors: Array) -> tuple[Noise, Array]:
    """The noise that the differences of neighbouring loops (k, n) show, each loop's mean apart."""
    differences = np.diff(errors, axis=0) / np.sqrt(2.0)
    differences = differences - differences.mean(axis=1, keepdims=True)
    breaks = np.zeros(differences.shape, dtype=bool)
    breaks[:, 0] = True
    return estimate(differences.ravel(), breaks.ravel()), differences.ravel()


def _drift(errors: Array, moved: Array, noise: Noise) -> tuple[str, float, int | None]:
    """What changes from loop to loop (k, n) most surely: words, its size, the loop of a jump.

    Each loop's departure from their mean is regressed on one of three shapes: a constant, the
    speed ``moved`` (n,) [1/s], which is a lag, and the mean mismatch itself; that which explains
    most is told, the mismatch only where it is clearly not one of the others.
    """
    mean = errors.mean(axis=0)
    colour = float(noise.innovation / max(1e-300, abs(1 - noise.coefficients.sum())))
    spread = max(colour, noise.marginal)  # noise at low frequencies counts
    best: tuple[float, str, float, int | None] = (SURELY, "", 0.0, None)
    for k, raw in enumerate((np.ones(len(mean)), -moved, mean)):
        shape = raw if k == 0 else raw - raw.mean()
        size = float(np.linalg.norm(shape))
        if size < 1e-12:
            continue
        score, rise, jump = _trend((errors - mean) @ shape / size, spread)
        if score > (CLEARER if k == 2 else 1.0) * best[0]:
            best = score, _words(k, rise, jump), rise / size, jump
    return best[1], best[2], best[3]


def _trend(values: Array, error: float) -> tuple[float, float, int | None]:
    """Standard score and rise of a steady trend or of one step, whichever explains more (k,)."""
    count = np.arange(len(values)) - (len(values) - 1) / 2
    slope = float(count @ values) / float(count @ count)
    steady = abs(slope) * float(np.sqrt(count @ count)) / error
    steps = []
    for n in range(1, len(values)):
        rise = float(values[n:].mean() - values[:n].mean())
        steps.append((abs(rise) * np.sqrt(n * (len(values) - n) / len(values)) / error, rise, n))
    score, rise, n = max(steps)
    if score**2 - steady**2 > STEP * score**2:
        return float(score), rise, n
    return float(steady), slope * (len(values) - 1), None


def _words(shape: int, rise: float, jump: int | None) -> str:
    if shape == 0:
        return "an offset that jumps" if jump is not None else "an offset that creeps"
    if shape == 1:
        return "a lag that jumps" if jump is not None else "a lag that grows, as of a clock"
    return "a mismatch that grows" if rise > 0 else "a mismatch that fades, as in a warm-up"


def repeating(proof: Proof) -> str:
    """Words for a mismatch that comes back in every loop and is no noise; empty without one."""
    loud = [(r.ratio, n, r) for n, r in repeated(proof) if r.ratio > LOUDER and r.sure > SURE]
    if not loud:
        return ""
    ratio, name, r = max(loud, key=lambda entry: entry[0])
    return (
        f"the mismatch of {r.channel} is {ratio:.1f} times what differs between the "
        f"{r.loops.count} loops ({name})"
    )


def as_rows(proof: Proof) -> list[dict[str, Any]]:
    """The ``repeats`` of the document: one row for each recording and channel with loops."""
    return [
        {
            "recording": name,
            "channel": r.channel,
            "loops": r.loops.count,
            "period": r.loops.period,
            "noise_std": r.noise.marginal,
            "colour": [float(a) for a in r.noise.coefficients],
            "mismatch_over_noise": r.ratio,
            "drift": r.drift or None,
            "drift_size": r.size if r.drift else None,
            "jump_at": r.at,
        }
        for name, r in repeated(proof)
    ]
