"""Step pulses: a commanded angle as the staircase that a stepper's driver makes of it.

A driver counts microsteps.  It steps where the ideal angle passes the middle between two of them,
so that the staircase stays within half a microstep of it.  In a recording, whose angles are linear
between rows, a pulse is two rows `EDGE` apart: one at its time, one behind the jump.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.recording.inputs import inputs
from corexy_fmi.recording.record import ANGLES, Recording

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
EDGE = 1e-8  # [s] in which a pulse's jump is carried out
SAME = 4 * EDGE  # [s] pulses nearer than this share their rows
HIGHEST_RATE = 1e6  # [1/s] of one motor's pulses
DECIMALS = 9  # of a microstep that count: rounding makes no pulses


@dataclass(frozen=True)
class Driver:
    """Microsteps in a full step, full steps in a turn.  Raises InputError for what is no count."""

    microsteps: int = 16
    steps: int = 200

    def __post_init__(self) -> None:
        for name, most in (("microsteps", 256), ("steps", 10_000)):
            value = getattr(self, name)
            if not 1 <= value <= most:
                raise InputError(f"{name}: found {value}, expected a count from 1 to {most}")

    @property
    def angle(self) -> float:
        """One microstep [rad]."""
        return 2 * np.pi / (self.steps * self.microsteps)


@dataclass(frozen=True, eq=False)
class Train:
    """Pulses of one motor: ``first`` microstep, ``time`` (n,) [s], ``way`` (n,) +1 or -1."""

    first: int
    time: Array
    way: Counts

    def counts(self, at: Array) -> Counts:
        """Microsteps at times (m,) [s]; a pulse counts from behind its edge on."""
        reached = np.searchsorted(self.time, at - EDGE / 2, side="right")
        return self.first + np.concatenate([[0], np.cumsum(self.way)])[reached]


def pulse_train(time: Array, angle: Array, step: float) -> Train:
    """The pulses of an angle (n,) [rad], linear between times (n,) [s]; ``step`` [rad].

    Raises InputError where it turns faster than `HIGHEST_RATE`.
    """
    place = np.round(angle / step, DECIMALS)
    rate = float(np.max(np.abs(np.diff(place) / np.diff(time)), initial=0.0))
    if rate > HIGHEST_RATE:
        raise InputError(
            f"pulses: {rate:.3g} microsteps a second, expected at most {HIGHEST_RATE:g}"
        )
    count = np.floor(place + 0.5).astype(np.int64)
    passed = np.diff(count)
    row = np.repeat(np.arange(len(passed)), np.abs(passed))
    nth = np.arange(len(row)) - np.repeat(
        np.cumsum(np.abs(passed)) - np.abs(passed), np.abs(passed)
    )
    way = np.sign(passed)[row]
    level = count[row] + way * (nth + 0.5)
    share = (level - place[row]) / (place[row + 1] - place[row])
    at = time[row] + np.clip(share, 0.0, 1.0) * (time[row + 1] - time[row])
    return Train(int(count[0]), at, way)


def staircase(order: Recording, driver: Driver) -> Recording:
    """The command phi1, phi2 of a recording as step pulses, its other channels left out.

    Rows are those of the command and two for each pulse.  The metadata say the driver and how many
    pulses each motor got either way.
    """
    given = inputs(order)
    if not all(name in given for name in ANGLES):
        raise InputError(f"{order.name}: no columns phi1, phi2, expected a stepper's command")
    trains = [pulse_train(order.time, given[name], driver.angle) for name in ANGLES]
    edges = _edges(np.concatenate([train.time for train in trains]))
    shared = [replace(train, time=_joined(edges, train.time)) for train in trains]
    time = _rows(order.time, edges)
    channels: dict[str, Array] = {
        name: np.multiply(driver.angle, train.counts(time))
        for name, train in zip(ANGLES, shared, strict=True)
    }
    return Recording(
        order.name, time, channels, {**order.metadata, "pulses": _told(driver, trains)}
    )


def _edges(times: Array) -> Array:
    """Times at which something jumps: the first of those that are one."""
    ordered = np.sort(times)
    return ordered[np.diff(ordered, prepend=-np.inf) > SAME]


def _joined(edges: Array, times: Array) -> Array:
    """The edge that each pulse belongs to."""
    return edges[np.searchsorted(edges, times, side="right") - 1] if len(times) else times


def _rows(time: Array, edges: Array) -> Array:
    """The command's rows that are not in an edge, and both rows of each edge."""
    if not len(edges):
        return time
    behind = np.searchsorted(edges, time + EDGE, side="right") - 1
    apart = (behind < 0) | (time - edges[behind] > 2 * EDGE)
    return np.sort(np.concatenate([time[apart], edges, edges + EDGE]))


def _told(driver: Driver, trains: list[Train]) -> str:
    """The line of metadata."""
    motors = (
        f"motor{n}=+{int(np.sum(train.way > 0))}-{int(np.sum(train.way < 0))}"
        for n, train in enumerate(trains, 1)
    )
    return f"microsteps={driver.microsteps} steps={driver.steps} {' '.join(motors)}"
