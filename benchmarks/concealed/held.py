"""What a diagnosis removes of the error on recordings kept back, against the noise-free truth."""

from __future__ import annotations

from typing import Any

import numpy as np
from plant.motions import STEP

from corexy_fmi.engine import Diagnosis

CHANNELS = ("x", "y")


def removed(case: Any, found: Diagnosis) -> float | None:
    """1 - sum (explained - truth)^2 / sum (retuned - truth)^2 over x and y of what was kept back,
    constant offsets aside; None where no held-out recording was replayed.
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
            sums += [_apart(state, truth, trace.measured[name]) for state in states]
    return float(1.0 - sums[0] / sums[1]) if sums[1] > 0.0 else None


def _apart(state: Any, truth: Any, measured: Any) -> float:
    """Squared distance to the truth where a sample was taken, the mean aside."""
    off = (state - truth)[np.isfinite(measured)]
    return float(np.sum((off - off.mean()) ** 2))
