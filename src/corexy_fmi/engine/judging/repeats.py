"""What loops of a motion say of the mismatch: what comes back in each of them is no noise, what
changes from one to the next is a drift.

A drift has a shape of its own: an offset that jumps (missed steps, slip) or creeps, a lag that
grows (a clock), a mismatch that fades or grows (warm-up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from corexy_fmi.engine.data.loops import Loops, looped_rows
from corexy_fmi.engine.fitting.noise import Noise, difference_noise, finest
from corexy_fmi.engine.fitting.quiet import LOUDER, SURE, independent, significance
from corexy_fmi.engine.judging.prove import Proof, Replay
from corexy_fmi.kernel.call import Array

STEP = 0.03  # share of what it explains that one step must explain beyond a trend
SURELY, CLEARER = 5.0, 1.03  # standard errors of a drift; times what a simpler shape explains


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


def repeated(proof: Proof) -> list[tuple[str, Repeated]]:
    """For each training run with loops what its channels show, after the retuned machine."""
    found = []
    for replayed in proof.replays["retuned"]:
        loops = replayed.run.loops if replayed.run.role == "train" else None
        for c in range(len(replayed.run.samples) if loops else 0):
            told = _channel(replayed, c, loops)
            if told is not None:
                found.append((replayed.run.name, told))
    return found


def _channel(replayed: Replay, channel: int, loops: Loops | None) -> Repeated | None:
    """What one channel shows over its whole loops; None where it has too few samples."""
    samples = replayed.run.samples[channel]
    time = replayed.run.excitation.time[samples.index]
    near = looped_rows(time, loops) if loops else None
    if loops is None or near is None:
        return None
    step = float(np.median(np.diff(time)))
    errors = replayed.errors[channel][near]  # (loops, samples of one)
    noise, differences = difference_noise(errors, finest(samples))
    used = errors.ravel()
    ratio = float(np.sqrt(np.mean((used - used.mean()) ** 2)) / max(noise.marginal, 1e-15))
    sure = significance(ratio, independent(used - used.mean()), independent(differences))
    moved = np.gradient(samples.value[near].mean(axis=0), step)
    drift, size, loop = _drift(errors, moved, noise)
    jump = None if loop is None else loops.start + loop * loops.period
    held = Loops(loops.start, loops.period, len(near))
    return Repeated(held, samples.channel, noise, ratio, sure, drift, size, jump)


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
