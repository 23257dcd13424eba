"""The motion that Klipper's resonance test commands (klippy/extras/resonance_tester.py).

A square wave in acceleration whose frequency rises by r a second: half period h = 1/(2 f),
amplitude p f, then f + r h, until f exceeds the last one.  Klipper up to 2024-12 swings about the
start point ("old"); since then it swings to one side, on top of a slow triangle in speed ("new").
Sources: Klipper at 28f06a104 (old), 16b4b6b30 and 84104bbb (new).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.motion import Motion, along
from corexy_fmi.profile import pieces

Array = NDArray[np.float64]
EXACT = 1e-6  # [Hz] by which the last frequency may be missed
FIRST_SWEEP, SECOND_SWEEP = math.sqrt(2) / 8, math.sqrt(2) / 8 + 0.25  # of the period


@dataclass(frozen=True)
class Pulses:
    """Settings of a test.

    ``first``, ``last`` [Hz], ``per_hertz`` [m/s^2 per Hz], ``rate`` [Hz/s]; of the new test
    ``sweep`` [m/s^2] and ``period`` [s] of the triangle (period 0: none); ``stop`` [m/s^2] is the
    machine's own acceleration, by which the new test ends.
    """

    first: float
    last: float
    per_hertz: float
    rate: float
    old: bool = False
    sweep: float = 0.4
    period: float = 1.2
    stop: float = 3.0

    def __post_init__(self) -> None:
        """Raises InputError for settings that make no test."""
        for name in ("first", "per_hertz", "rate", "stop"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"{name}: found {value!r}, expected a number above 0")
        if not self.first < self.last <= 1e3:
            raise InputError(
                f"last: found {self.last!r} Hz, expected more than {self.first:g} and at most 1000"
            )
        if self.period < 0 or self.sweep < 0:
            raise InputError("sweep, period: found a negative number, expected 0 or more")


OLD = Pulses(5.0, 133.33, 0.075, 1.0, old=True)
NEW = Pulses(5.0, 135.0, 0.060, 1.0)


def changed(test: Pulses, given: Mapping[str, float | None]) -> Pulses:
    """The test with those settings that are given; raises InputError where that makes none."""
    numbers = asdict(test) | {name: value for name, value in given.items() if value is not None}
    return Pulses(**numbers)


def frequencies(test: Pulses) -> Array:
    """Frequency of each half period [Hz]."""
    found, f = [], test.first
    while f <= test.last + EXACT:
        found.append(f)
        f += test.rate / (2 * f)
    return np.array(found)


def swept_motion(test: Pulses, direction: Sequence[float], start: Sequence[float]) -> Motion:
    """The test's motion along a direction from a start point [m]."""
    way = np.asarray(direction, dtype=float)
    way = way / np.linalg.norm(way)
    profile = pieces(*(_old(test) if test.old else _new(test)))
    origin = np.asarray(start, dtype=float)
    return along(lambda s: origin + s[:, None] * way, 0.0, profile)


def _old(test: Pulses) -> tuple[Array, Array]:
    """Durations [s] and accelerations [m/s^2]; out and back over p/(32 f), to one side in turn."""
    f = frequencies(test)
    sign = np.where(np.arange(len(f)) % 2 == 0, 1.0, -1.0)
    a, quarter = test.per_hertz * f, 0.25 / f
    durations = np.repeat(quarter, 2)
    accelerations = np.repeat(-sign * a, 2)
    edge = math.sqrt(0.5) * quarter[[0, -1]]
    out, back = [edge[0], edge[0]], [edge[1], edge[1]]  # from rest, and to rest
    return (
        np.concatenate([out, durations[1:-1], back]),
        np.concatenate([[a[0], -a[0]], accelerations[1:-1], [-sign[-1] * a[-1], sign[-1] * a[-1]]]),
    )


def _new(test: Pulses) -> tuple[Array, Array]:
    """The same of the new test: | + - | - + | with a triangle in speed, then a stop."""
    f = frequencies(test)
    sign = np.where(np.arange(len(f)) % 2 == 0, 1.0, -1.0)
    quarter = np.repeat(0.25 / f, 2)
    pulse = np.repeat(sign * test.per_hertz * f, 2) * np.tile([1.0, -1.0], len(f))
    ends = np.cumsum(quarter)
    turns = _turns(test, float(ends[-1]))
    border = np.unique(np.concatenate([[0.0], ends, turns[turns < ends[-1]]]))
    middle = (border[1:] + border[:-1]) / 2
    durations = np.diff(border)
    accelerations = pulse[np.searchsorted(ends, middle)] + _sweep(test, turns, middle)
    speed = float(accelerations @ durations)
    if abs(speed) < 1e-9:
        return durations, accelerations
    return (
        np.append(durations, abs(speed) / test.stop),
        np.append(accelerations, -math.copysign(test.stop, speed)),
    )


def _turns(test: Pulses, duration: float) -> Array:
    """Times [s] at which the slow acceleration changes its sign."""
    if not (test.period and test.sweep):
        return np.empty(0)
    second = (FIRST_SWEEP + SECOND_SWEEP) * test.period
    later = second + np.arange(1 + int(2 * duration / test.period)) * test.period / 2
    return np.concatenate([[FIRST_SWEEP * test.period], later])


def _sweep(test: Pulses, turns: Array, time: Array) -> Array:
    """Slow acceleration [m/s^2] at times (n,)."""
    if not len(turns):
        return np.zeros(len(time))
    return test.sweep * np.where(np.searchsorted(turns, time) % 2 == 0, 1.0, -1.0)
