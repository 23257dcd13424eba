"""Import of a resonance test's raw samples: the excitation that Klipper commanded is rebuilt."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.motion import Motion, chain, rest
from corexy_fmi.recording.accelerometer import along_stage, at_rest, commanded, read_samples
from corexy_fmi.recording.align import Signal, best_lag
from corexy_fmi.recording.record import Recording
from corexy_fmi.resonance import Pulses, swept_motion

Array = NDArray[np.float64]
COMPARED = 1e-3  # [s] grid of the commanded acceleration


def import_resonance(
    path: str | Path,
    test: Pulses,
    direction: Sequence[float],
    start: Sequence[float],
    axes: str,
    pulley_radius: float,
    offset: float | None = None,
) -> Recording:
    """The recording of a test along a direction from a start point [m] of the stage's centre.

    ``offset`` [s] is the time of the first pulse after the first sample; without it, that is found
    by cross-correlation, and the clock is left free.  Raises InputError where the file cannot be
    understood or shows none of the test.
    """
    path = Path(path)
    stamps, felt = read_samples(path)
    measured, since = along_stage(felt, axes), stamps - stamps[0]
    measured -= np.median(measured, axis=0)
    pulses = swept_motion(test, direction, start)
    begin = _begin(pulses, since, measured, path) if offset is None else offset
    since = since + max(-begin, 0.0)
    motion = chain(rest(start, max(begin, 0.0)), pulses, rest(pulses.end, float(since[-1])))
    measured -= at_rest(measured, since < max(begin, 0.0) - 0.05)
    about = {
        "source": f"klipper resonance test {path.name}",
        "excitation": f"{'old' if test.old else 'new'} {test.first:g}..{test.last:g} Hz, "
        f"{test.per_hertz:g} m/s^2 per Hz, {test.rate:g} Hz/s, along {tuple(direction)}",
        "axes": axes,
        "first_pulse": f"{begin:.4f} s after the first sample",
    }
    about |= {"clock": "free"} if offset is None else {}
    return commanded(path.name, since, measured, motion, pulley_radius, about)


def _begin(pulses: Motion, since: Array, measured: Array, path: Path) -> float:
    """Time of the first pulse after the first sample [s]."""
    time = np.arange(-2 * COMPARED, pulses.duration + 3 * COMPARED, COMPARED)
    place = pulses.position(np.clip(time, 0.0, pulses.duration))
    pushed = np.gradient(np.gradient(place, time, axis=0), time, axis=0)
    what = f"{path}: the samples and the test's excitation"
    return best_lag(Signal(time, pushed), Signal(since, measured), what)
