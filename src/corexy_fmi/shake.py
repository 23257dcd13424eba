"""Shaking: a sine of steady acceleration whose frequency sweeps over what a stage rings at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from corexy_fmi.motion import Array, Motion

FADE = 2.0  # periods of the lowest frequency in which it swells and dies away


def slowest(acceleration: float, speed: float, reach: float) -> float:
    """The lowest frequency [Hz] at which a sine of an acceleration [m/s^2] keeps to a speed [m/s]
    and a reach [m].
    """
    return max(acceleration / speed, float(np.sqrt(acceleration / reach))) / (2 * np.pi)


def shake(
    axis: Sequence[float], acceleration: float, frequencies: tuple[float, float], duration: float
) -> Motion:
    """A sine along an axis around the origin, whose frequency [Hz] sweeps linearly while its
    acceleration [m/s^2] stays: what resonance tests of a machine do. It starts and ends at rest.
    """
    first, last = frequencies
    direction = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    fade = min(FADE / first, duration / 2)

    def position(time: Array) -> Array:
        frequency = first + (last - first) * time / duration
        phase = 2 * np.pi * (first * time + (last - first) * time**2 / (2 * duration))
        edge = np.clip(np.minimum(time, duration - time) / fade, 0, 1)
        size = acceleration / (2 * np.pi * frequency) ** 2 * (1 - np.cos(np.pi * edge)) / 2
        return np.asarray((size * np.sin(phase))[:, None] * direction)

    return Motion(duration, position)
