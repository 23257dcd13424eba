"""Modes: how masses on damped springs swing under what the stage does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from corexy_fmi.engine.naming.modes import swing
from corexy_fmi.engine.places.probe_laws import Motion
from corexy_fmi.kernel.call import Array

MODES = tuple(np.geomspace(3.0, 100.0, 12))  # [Hz] of what swings on the stage, or under it
DAMPED = 0.05  # its damping ratio


def swung(runs: list[Motion]) -> Iterator[tuple[str, list[dict[str, Array]]]]:
    """For each mode a word, and where along each axis of every run it comes to, and how fast."""
    times = [m.time for m in runs]
    pushed = [{a: np.gradient(m.speed[a], m.time) for a in "xy"} for m in runs]
    for f in MODES:
        bent = [
            {axis: swing(values, t, f, DAMPED) for axis, values in pair.items()}
            for pair, t in zip(pushed, times, strict=True)
        ]
        late = [
            {axis: np.gradient(values, t) for axis, values in pair.items()}
            for pair, t in zip(bent, times, strict=True)
        ]
        yield f"a mode near {f:.0f} Hz", bent
        yield f"a mode near {f:.0f} Hz, damped", late
