"""How far the models of a diagnosis are from the noise-free truth, kept back or used."""

from __future__ import annotations

from typing import Any

import numpy as np
from plant.evidence import whiten
from plant.motions import STEP
from plant.world import FILES

from corexy_fmi.engine import Diagnosis

CHANNELS = ("x", "y")


def removed(case: Any, found: Diagnosis) -> float | None:
    """1 - sum (explained - truth)^2 / sum (retuned - truth)^2 over x and y of what was kept back,
    constant offsets aside where no zero is known; None where no held-out recording was replayed.
    """
    sums = np.zeros(2)
    for trace in found.evidence.traces:
        clean = case.holdout_clean.get(trace.recording)
        if clean is None:
            continue
        rows = np.rint((trace.time - trace.time[0]) / STEP).astype(int)
        for name in CHANNELS:
            truth = clean[name][np.clip(rows, 0, len(clean[name]) - 1)]
            states = (trace.explained[name], trace.retuned[name])
            taken = np.isfinite(trace.measured[name])
            sums += [_apart((s - truth)[taken], case.world.zeroed) for s in states]
    return float(1.0 - sums[0] / sums[1]) if sums[1] > 0.0 else None


def reached(case: Any, found: Diagnosis) -> dict[str, float]:
    """How near the machines of a diagnosis come to the noise-free truth on the training recordings,
    in E's units: E of what a machine lacks is no more.
    """
    return _distances(case, found, case.train_clean)


def kept_back(case: Any, found: Diagnosis) -> dict[str, float]:
    """The same on what was kept back: all that is measured counts, each channel in its noise."""
    return _distances(case, found, case.holdout_clean)


def _distances(case: Any, found: Diagnosis, truth: dict[str, Any]) -> dict[str, float]:
    """Squared distance (s - m)' S^-1 (s - m) of the retuned and the explained machine to the truth,
    over all channels that are measured.
    """
    sums = {"retuned": 0.0, "explained": 0.0}
    for trace in found.evidence.traces:
        clean = truth.get(trace.recording)
        if clean is None:
            continue
        noise = case.world.masks[FILES.index(trace.recording)]
        for state in sums:
            shown = getattr(trace, state)
            for name in (n for n in noise if n in shown):
                there = np.interp(
                    STEP * np.arange(len(clean[name])), trace.time - trace.time[0], shown[name]
                )
                sums[state] += float(np.sum(whiten(there - clean[name], *noise[name]) ** 2))
    return sums


def _apart(off: Any, zeroed: bool) -> float:
    """Squared distance to the truth; the mean aside where the sensor's zero is its own."""
    return float(np.sum((off - (0.0 if zeroed else off.mean())) ** 2))
