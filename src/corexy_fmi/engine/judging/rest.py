"""Noise told from mismatch without a model of either: at rest only the noise is left.

A slow mismatch can pass for coloured noise in every statistic of the whole residual.  But noise
does not know whether the stage moves, apart from jitter of the stamps (`jitter.py`); where the
residual is much larger in motion than at rest, something is missing.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.fitting.jitter import scatter
from corexy_fmi.engine.fitting.noise import quick_noise
from corexy_fmi.engine.fitting.quiet import (
    FEWEST,
    LOUDER,
    ROWS,
    SURE,
    at_rest,
    independent,
    left,
    significance,
)
from corexy_fmi.engine.judging.prove import Proof, Replay


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
    late = np.concatenate([scatter(r.run, r.run.samples[c], r.errors[c]) for r, c in parts])[~rest]
    loud = left(float(np.sqrt(np.mean(moving**2))), float(np.mean(late)))
    ratio = loud / max(float(np.sqrt(np.mean(still**2))), quick)
    return ratio, significance(ratio, *sizes)


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
