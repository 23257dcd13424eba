"""The motions of the reproduction: one corner at constant speed, and one corner pulse by pulse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.corners import contour_error, overshoot
from corexy_fmi.kernel.call import Excitation
from corexy_fmi.motion import Motion, chain, command, line
from corexy_fmi.recording import Recording
from corexy_fmi.reproduce.paper import STEP_ANGLE

Array = NDArray[np.float64]
LONG, SHORT = 1.5, 0.03  # [s] a side takes at least, [m] it measures at least
PULSE, ROW = 1e-4, 1e-3  # [s] in which a pulse is carried out; between rows
WAYS = {"x->y": ((1.0, 0.0), (0.0, 1.0)), "y->x": ((0.0, 1.0), (-1.0, 0.0))}


@dataclass(frozen=True, eq=False)
class Corner:
    """One turn from rest at the origin: directions, corner [m], angles [rad] at times [s]."""

    turn: str
    corner: Array
    excitation: Excitation
    passed: float

    @property
    def ways(self) -> tuple[Array, Array]:
        """Unit vectors of both sides."""
        first, second = WAYS[self.turn]
        return np.array(first), np.array(second)

    def near(self, path: Array) -> Array:
        """The rows (m, 2) of a path (n, 2) from the middle of the first side on."""
        return path[self.excitation.time > self.passed / 2]

    def error(self, path: Array) -> float:
        """Eq. (17) [m] of a path (n, 2); NaN where the 45-degree line is never crossed."""
        return contour_error(self.near(path), self.corner, *self.ways)

    def overshoot(self, path: Array) -> float:
        """Largest excursion [m] beyond the corner in the old direction."""
        return overshoot(self.near(path), self.corner, self.ways[0])

    def waviness(self, path: Array) -> float:
        """Peak to peak [m] across the last half of the second side."""
        time = self.excitation.time
        last = path[time > (self.passed + time[-1]) / 2]
        return float(np.ptp(last @ self.ways[0]))


def corner_motion(turn: str, speed: float) -> tuple[Motion, Array, float]:
    """A turn at constant speed [m/s]: the motion, its corner (2,) [m] and when it is passed [s]."""
    first, second = (np.array(way) for way in WAYS[turn])
    side = max(LONG * speed, SHORT)
    corner, end = side * first, side * (first + second)
    motion = chain(line((0, 0), corner.tolist(), speed), line(corner.tolist(), end.tolist(), speed))
    return motion, corner, side / speed


def at_speed(turn: str, speed: float, radius: float) -> tuple[Corner, Recording]:
    """A turn at constant speed [m/s] on pulleys of a radius [m], also as a command."""
    motion, corner, passed = corner_motion(turn, speed)
    order = command(motion, radius, name=f"{turn} at {speed:g} m/s")
    excitation = Excitation(order.time, order["phi1"], order["phi2"])
    return Corner(turn, corner, excitation, passed), order


def full_step(radius: float) -> float:
    """Travel [m] of one axis when both motors make a full step."""
    return float(radius * np.deg2rad(STEP_ANGLE))


def by_pulses(turn: str, interval: float, radius: float, count: int = 6) -> Corner:
    """A turn in full steps of both motors, one every ``interval`` [s], ``count`` for each side."""
    step, (first, second) = full_step(radius), (np.array(way) for way in WAYS[turn])
    places = step * np.concatenate(
        [
            np.outer(np.arange(count + 1), first),
            count * first + np.outer(range(1, count + 1), second),
        ]
    )
    begins = interval * np.arange(1, 2 * count + 1)
    knots = np.concatenate([[0.0], np.column_stack([begins, begins + PULSE]).ravel()])
    at = np.repeat(places, 2, axis=0)[:-1]
    time = np.union1d(np.arange(0.0, begins[-1] + interval, ROW), knots)
    time = time[np.append(True, np.diff(time) > 1e-9)]
    x, y = (np.interp(time, knots, at[:, axis]) for axis in (0, 1))
    drive = Excitation(time, (x + y) / radius, (x - y) / radius)
    return Corner(turn, places[count], drive, float(begins[count - 1]))


def one_pulse(axis: str, radius: float, duration: float) -> Excitation:
    """One full step of both motors along an axis at once, then rest for a time [s]."""
    time = np.union1d(np.arange(0.0, duration, ROW), [PULSE])
    travel = full_step(radius) * np.minimum(time / PULSE, 1.0)
    sign = 1 if axis == "x" else -1
    return Excitation(time, travel / radius, sign * travel / radius)
