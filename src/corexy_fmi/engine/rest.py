"""Noise told from mismatch without a model of either: at rest only the noise is left.

A slow mismatch can pass for coloured noise in every statistic of the whole residual.  But noise
does not know whether the stage moves; where the residual is much larger in motion than at rest,
something is missing.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.noise import quick_noise
from corexy_fmi.engine.prove import Proof, Replay
from corexy_fmi.engine.samples import Run
from corexy_fmi.kernel.call import Array

QUIET = 0.3  # [s] without a change of the inputs, after which the stage rests
ROWS, FEWEST = 200, 8.0  # samples, and independent ones, at rest and in motion
LOUDER, SURE = 1.5, 4.0  # ratio of standard deviations; standard errors of its logarithm


def at_rest(run: Run) -> np.ndarray:
    """Rows (n,) whose inputs stood still for a while; none where voltages are the inputs."""
    e = run.excitation
    if e.mode == "voltages":
        return np.zeros(len(e.time), dtype=bool)
    moved = (np.diff(e.input1, prepend=np.nan) != 0) | (np.diff(e.input2, prepend=np.nan) != 0)
    last = np.maximum.accumulate(np.where(moved, e.time, -np.inf))
    return np.asarray(e.time - last > QUIET)


def independent(errors: Array) -> float:
    """How many independent samples tell as much about the variance (Bartlett).

    No mean is removed: in a short rest, slow noise is little but mean, and counts as one sample.
    """
    spectrum = np.abs(np.fft.rfft(errors, 2 * len(errors))) ** 2
    correlation = np.fft.irfft(spectrum)[: max(len(errors) // 4, 1)]
    correlation /= max(correlation[0], 1e-300)
    return len(errors) / float(2 * np.sum(correlation**2) - 1)


def _ratio(parts: list[tuple[Replay, int]]) -> tuple[float, float]:
    """Standard deviation in motion over that at rest, and its significance; 0, 0 if unknown.

    ``parts`` are a channel's replays on the parts of one recording.
    """
    errors = np.concatenate([r.errors[c] for r, c in parts])
    rest = np.concatenate([at_rest(r.run)[r.run.samples[c].index] for r, c in parts])
    moving, still = errors[~rest], errors[rest]
    if min(len(moving), len(still)) < ROWS:  # too few to see how they hang together
        return 0.0, 0.0
    sizes = independent(moving), independent(still)
    if min(sizes) < FEWEST:
        return 0.0, 0.0
    quick = max(quick_noise(r.run.samples[c]) for r, c in parts)
    ratio = float(np.sqrt(np.mean(moving**2)) / max(np.sqrt(np.mean(still**2)), quick))
    return ratio, float(np.log(max(ratio, 1e-9)) / np.sqrt(0.5 / sizes[0] + 0.5 / sizes[1]))


def _recordings(proof: Proof) -> dict[tuple[str, str], list[tuple[Replay, int]]]:
    """The retuned machine's replays of every recording that was used, channel by channel."""
    used = {run.name for run in proof.runs if run.role == "train"}
    parts: dict[tuple[str, str], list[tuple[Replay, int]]] = {}
    for replayed in proof.replays["retuned"]:
        for c, samples in enumerate(replayed.run.samples):
            if replayed.run.name in used:
                parts.setdefault((replayed.run.name, samples.channel), []).append((replayed, c))
    return parts


def restless(proof: Proof) -> str:
    """Words for a mismatch that is much larger in motion than at rest; empty where there is none.

    Judged on the retuned machine's replay of the recordings that were used.
    """
    found = [(*_ratio(parts), *key) for key, parts in _recordings(proof).items()]
    loud = [f for f in found if f[0] > LOUDER and f[1] > SURE]
    if not loud:
        return ""
    ratio, _, name, channel = max(loud)
    return f"in motion the mismatch of {channel} is {ratio:.1f} times what it is at rest ({name})"
