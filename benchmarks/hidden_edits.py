"""Changes to hide in a real recording: what a sensor, a clock or a shaper would have done to it.

Every edit acts on the measured channels, so that the real noise and all that the model leaves out
stay in.  A shaper in front of the command acts on them too: command and stage commute, but for dry
friction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.recording import Recording

Array = NDArray[np.float64]
BLOCK = 40  # samples of noise that stay together
SHARE = 0.5  # size of the sham's noise over that of the recording


@dataclass(frozen=True)
class Edit:
    """``effect`` is what the catalogue calls it, "" for nothing; sizes are drawn from ``range``."""

    name: str
    effect: str
    parameter: str
    range: tuple[float, float]
    apply: Callable[[Recording, float, np.random.Generator], Recording]


def _samples(recording: Recording, channel: str) -> tuple[NDArray[np.intp], Array, Array]:
    """Rows, times [s] and values of a channel's samples."""
    rows = np.flatnonzero(np.isfinite(recording[channel]))
    return rows, recording.time[rows], recording[channel][rows]


def _with(recording: Recording, change: Callable[[Array, Array], Array]) -> Recording:
    """The recording with every measured channel changed, given times and values of its samples."""
    channels = dict(recording.channels)
    for name in recording.measured:
        rows, time, values = _samples(recording, name)
        channels[name] = channels[name].copy()
        channels[name][rows] = change(time, values)
    return replace(recording, channels=channels)


def delayed(recording: Recording, seconds: float, _: np.random.Generator) -> Recording:
    """Samples late by whole samples, so that their noise stays as it is."""

    def late(time: Array, values: Array) -> Array:
        count = round(seconds / float(np.median(np.diff(time))))
        return np.concatenate([np.full(count, np.median(values[:count])), values[:-count]])

    return _with(recording, late)


def turned(recording: Recording, angle: float, _: np.random.Generator) -> Recording:
    """The sensor turned: x - a y, y + a x."""
    channels = dict(recording.channels)
    for one, other in (("x", "y"), ("ax", "ay")):
        if {one, other} <= set(recording.measured):
            a, b = recording[one], recording[other]
            channels |= {one: a - angle * b, other: b + angle * a}
    return replace(recording, channels=channels)


def scaled(recording: Recording, factor: float, _: np.random.Generator) -> Recording:
    """The sensor's x reads too much."""
    names = [n for n in ("x", "ax") if n in recording]
    channels = {n: factor * recording[n] for n in names}
    return replace(recording, channels=dict(recording.channels) | channels)


def stretched(recording: Recording, ratio: float, _: np.random.Generator) -> Recording:
    """A stamp t was taken at t (1 + ratio)."""
    return _with(recording, lambda t, v: np.interp(t[0] + (t - t[0]) * (1 + ratio), t, v))


def shaped(recording: Recording, frequency: float, _: np.random.Generator) -> Recording:
    """A ZV shaper for a mode [Hz] of damping ratio 0.1 (Singer, Seering 1990)."""
    zeta = 0.1
    fall = float(np.exp(-zeta * np.pi / np.sqrt(1 - zeta**2)))
    wait = 0.5 / (frequency * np.sqrt(1 - zeta**2))

    def twice(time: Array, values: Array) -> Array:
        later = np.interp(time - wait, time, values, left=float(values[0]))
        return (values + fall * later) / (1 + fall)

    return _with(recording, twice)


def sham(recording: Recording, _: float, random: np.random.Generator) -> Recording:
    """Nothing but more noise: the recording's own fast part, resampled in blocks."""

    def noisier(time: Array, values: Array) -> Array:
        smooth = np.convolve(values, np.full(5, 0.2), mode="same")
        quiet = np.abs(np.gradient(smooth)) <= np.median(np.abs(np.gradient(smooth)))
        pool = (values - smooth)[quiet]
        starts = random.integers(0, len(pool) - BLOCK, len(values) // BLOCK + 1)
        drawn = np.concatenate([pool[s : s + BLOCK] for s in starts])[: len(values)]
        return values + SHARE * (drawn - drawn.mean())

    return _with(recording, noisier)


EDITS = {
    edit.name: edit
    for edit in (
        Edit("late samples", "sensor_delay", "delay", (3e-3, 8e-3), delayed),
        Edit("turned sensor", "sensor_rotation", "angle", (0.1, 0.25), turned),
        Edit("scaled x", "sensor_scale", "scale_x", (1.1, 1.3), scaled),
        Edit("stretched clock", "clock_drift", "ratio", (0.01, 0.03), stretched),
        Edit("shaper", "", "frequency", (30.0, 60.0), shaped),
        Edit("sham 1", "", "", (0.0, 0.0), sham),
        Edit("sham 2", "", "", (0.0, 0.0), sham),
    )
}


def truth_of(edit: Edit, seed: int, span: tuple[float, float] | None) -> dict[str, Any]:
    """What is hidden, drawn by a seed; ``span`` narrows the range of sizes."""
    low, high = span or edit.range
    size = float(np.random.default_rng(seed).uniform(low, high))
    return {"edit": edit.name, "effect": edit.effect, "parameter": edit.parameter, "size": size,
            "seed": seed}  # fmt: skip


def hidden(recording: Recording, truth: Mapping[str, Any]) -> Recording:
    """The recording with a truth hidden in it."""
    random = np.random.default_rng(truth["seed"] + 1)
    return EDITS[truth["edit"]].apply(recording, truth["size"], random)
