"""Timing along a path: arc length travelled against time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """``travel`` maps times (n,) in s to arc length (n,) in m; ``instants`` [s] are its kinks."""

    duration: float
    travel: Callable[[Array], Array]
    instants: tuple[float, ...] = ()


def constant_speed(length: float, speed: float) -> Profile:
    """Speed [m/s] from the first instant to the last, over a length [m]."""
    _positive(speed, "speed", "m/s")
    return Profile(length / speed, lambda time: np.clip(speed * time, 0.0, length))


def trapezoid(length: float, speed: float, acceleration: float) -> Profile:
    """From rest to rest with constant acceleration [m/s^2]; a triangle where the way is short."""
    _positive(speed, "speed", "m/s")
    _positive(acceleration, "acceleration", "m/s^2")
    top = min(speed, float(np.sqrt(length * acceleration)))
    ramp = top / acceleration
    duration = float(length / top + ramp) if length else 0.0

    def travel(time: Array) -> Array:
        since, left = np.clip(time, 0, duration), np.clip(duration - time, 0, duration)
        gained = acceleration * np.minimum(since, ramp) ** 2 / 2
        lost = length - acceleration * np.minimum(left, ramp) ** 2 / 2
        cruise = gained + top * np.clip(since - ramp, 0, None)
        return np.where(left < ramp, lost, cruise)

    return Profile(duration, travel, (float(ramp), float(duration - ramp)) if length else ())


def _positive(value: float, what: str, unit: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{what}: found {value!r}, expected a positive number [{unit}]")


def pieces(durations: Array, accelerations: Array) -> Profile:
    """From rest, one constant acceleration [m/s^2] after the other, each for its time [s].

    Both are (n,); what is travelled may come back.
    """
    begins = np.concatenate([[0.0], np.cumsum(durations)])
    speeds = np.concatenate([[0.0], np.cumsum(accelerations * durations)])
    ways = (speeds[:-1] + accelerations * durations / 2) * durations
    places = np.concatenate([[0.0], np.cumsum(ways)])

    def travel(time: Array) -> Array:
        within = np.clip(time, 0.0, begins[-1])
        piece = np.clip(np.searchsorted(begins, within, side="right") - 1, 0, len(durations) - 1)
        since = within - begins[piece]
        gained = (speeds[piece] + accelerations[piece] * since / 2) * since
        return np.asarray(places[piece] + gained)

    return Profile(float(begins[-1]), travel, tuple(begins[1:-1].tolist()))
