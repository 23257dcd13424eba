"""Motions of the end-effector in time, and the motor angles that command them.

A `Motion` is a path with its timing; `command` samples it into a recording of phi1, phi2 by the
inverse of eq. (1): phi_1 = (x + y) / r, phi_2 = (x - y) / r.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.machine.record import Machine
from corexy_fmi.profile import Profile, constant_speed, trapezoid
from corexy_fmi.recording.record import Recording
from corexy_fmi.topologies import BY_EQUATION_1, COREXY

MOST_ROWS, RATE = 1e8, 1000.0  # of a motion; rows a second [Hz] where nobody says

Array = NDArray[np.float64]
SAME_INSTANT = 1e-9  # [s] rows nearer than this are one


@dataclass(frozen=True)
class Motion:
    """Position in time: ``position`` maps times (n,) in s to points (n, 2) in m.

    ``instants`` [s] are the times at which a row must stand: corners and changes of acceleration.
    """

    duration: float
    position: Callable[[Array], Array]
    instants: tuple[float, ...] = ()

    @property
    def end(self) -> tuple[float, float]:
        """Where it comes to its end [m]."""
        x, y = self.position(np.array([self.duration]))[0]
        return float(x), float(y)


def rest(point: Sequence[float], duration: float) -> Motion:
    """Stand still at a point [m] for a time [s]."""
    place = np.asarray(point, dtype=float)
    return Motion(duration, lambda time: np.broadcast_to(place, (len(time), 2)))


def along(curve: Callable[[Array], Array], length: float, profile: Profile) -> Motion:
    """Follow a curve, arc length (n,) in m to points (n, 2) in m, with the timing of a profile."""
    return Motion(profile.duration, lambda time: curve(profile.travel(time)), profile.instants)


def line(
    start: Sequence[float], end: Sequence[float], speed: float, acceleration: float | None = None
) -> Motion:
    """A straight move [m] at a speed [m/s]: constant, or a trapezoid from rest to rest [m/s^2]."""
    origin, target = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(target - origin))
    profile = _profile(length, speed, acceleration)
    share = lambda s: (s / length if length else 0 * s)[:, None]  # noqa: E731
    return along(lambda s: origin + share(s) * (target - origin), length, profile)


def circle(
    radius: float,
    speed: float,
    loops: int = 1,
    acceleration: float | None = None,
    centre: Sequence[float] = (0.0, 0.0),
) -> Motion:
    """Counter-clockwise circles [m], from the rightmost point, at a path speed [m/s]."""
    middle, length = np.asarray(centre, dtype=float), 2 * np.pi * radius * loops
    profile = _profile(length, speed, acceleration)

    def curve(s: Array) -> Array:
        return middle + radius * np.column_stack([np.cos(s / radius), np.sin(s / radius)])

    return along(curve, length, profile)


def chirp(
    axis: Sequence[float],
    amplitude: float,
    frequencies: tuple[float, float],
    duration: float,
    centre: Sequence[float] = (0.0, 0.0),
) -> Motion:
    """A sine along an axis whose frequency [Hz] sweeps linearly; amplitude [m].

    It fades in and out over one period of the lowest frequency, so that it starts and ends at rest.
    """
    first, last = frequencies
    direction = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    middle, fade = np.asarray(centre, dtype=float), min(1 / min(first, last), duration / 2)

    def position(time: Array) -> Array:
        phase = 2 * np.pi * (first * time + (last - first) * time**2 / (2 * duration))
        edge = np.clip(np.minimum(time, duration - time) / fade, 0, 1)
        swing = amplitude * np.sin(phase) * (1 - np.cos(np.pi * edge)) / 2
        return middle + swing[:, None] * direction

    return Motion(duration, position)


def star(radius: float, points: int, speed: float, acceleration: float | None = None) -> Motion:
    """From the centre out to each of so many points [m] and back: every direction, both ways."""
    angles = 2 * np.pi * np.arange(points) / points
    tips = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    moves = []
    for tip in tips:
        moves += [line((0, 0), tip, speed, acceleration), line(tip, (0, 0), speed, acceleration)]
    return chain(*moves)


def chain(*motions: Motion) -> Motion:
    """One motion after the other; where two meet, a row stands."""
    starts = np.concatenate([[0.0], np.cumsum([motion.duration for motion in motions])])

    def position(time: Array) -> Array:
        which = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(motions) - 1)
        points = np.empty((len(time), 2))
        for index, motion in enumerate(motions):
            here = which == index
            points[here] = motion.position(np.minimum(time[here] - starts[index], motion.duration))
        return points

    inner = [s + t for s, m in zip(starts, motions, strict=False) for t in m.instants]
    return Motion(float(starts[-1]), position, tuple(sorted([*inner, *starts[1:-1].tolist()])))


def command(
    motion: Motion, pulley_radius: float, rate: float = RATE, name: str = "command"
) -> Recording:
    """Sample a motion into phi1, phi2 [rad]: rows at ``rate`` [Hz], and one at each instant."""
    time = row_times(motion, rate)
    x, y = motion.position(time).T
    return Recording(name, time, {"phi1": (x + y) / pulley_radius, "phi2": (x - y) / pulley_radius})


def follow(
    path: Recording, pulley_radius: float, centre: Sequence[float] = (0.0, 0.0)
) -> Recording:
    """The phi1, phi2 [rad] that lead along x, y [m] of a recording; ``centre`` is the stage's."""
    x, y = path["x"] - centre[0], path["y"] - centre[1]
    channels = {"phi1": (x + y) / pulley_radius, "phi2": (x - y) / pulley_radius}
    return Recording(path.name, path.time, channels, path.metadata)


def place(phi1: Array, phi2: Array, pulley_radius: float) -> Array:
    """Where angles (n,) [rad] lead the effector, (2, n) [m], on stiff belts: eq. (1)."""
    return pulley_radius / 2 * np.array([phi1 + phi2, phi1 - phi2])


def row_times(motion: Motion, rate: float) -> Array:
    """The grid of ``rate`` [Hz] with the motion's instants and its end, (n,) in s.

    Raises InputError where that is more rows than memory holds.
    """
    if not motion.duration * rate <= MOST_ROWS:
        raise InputError(
            f"motion: found {motion.duration:g} s at {rate:g} Hz, expected at most "
            f"{MOST_ROWS:g} rows"
        )
    grid = np.arange(int(np.floor(motion.duration * rate + SAME_INSTANT)) + 1) / rate
    marks = np.unique([*motion.instants, motion.duration])
    marks = marks[np.concatenate([[True], np.diff(marks) > SAME_INSTANT])]
    near = marks[np.clip(np.searchsorted(marks, grid - SAME_INSTANT), 0, len(marks) - 1)]
    grid = grid[np.abs(grid - near) > SAME_INSTANT]
    return np.sort(np.concatenate([grid, marks]))


def check_kind(machine: Machine, *kinds: str) -> Machine:
    """The machine, if its topology is one of ``kinds`` (Core-XY alone by default).

    Raises InputError otherwise.
    """
    known = kinds or (COREXY,)
    if machine.topology not in known:
        listed = " or ".join(repr(name) for name in known)
        raise InputError(
            f"machine {machine.name!r}: topology {machine.topology!r}, expected {listed} here"
        )
    return machine


def half_stage(machine: Machine) -> tuple[float, float]:
    """How far the carriage may leave the centre along x and y, (W - c)/2 and H/2 [m]."""
    numbers = machine.parameters
    half_x = (numbers["bridge_pulley_spacing"] - numbers["clip_spacing"]) / 2
    return half_x, numbers["motor_idler_span"] / 2


def check_stage(recording: Recording, machine: Machine) -> None:
    """Raises InputError where the command leaves `half_stage`."""
    check_kind(machine, *BY_EQUATION_1)
    path = place(recording["phi1"], recording["phi2"], machine.parameters["pulley_radius"])
    for axis, limit, way in zip("xy", half_stage(machine), path, strict=True):
        reach = float(np.nanmax(np.abs(way)))
        if reach > limit * (1 + 1e-12):
            raise InputError(
                f"{recording.name}: |{axis}| reaches {reach:.6g} m and leaves the stage of "
                f"machine {machine.name!r}, expected at most {limit:.6g} m"
            )


def _profile(length: float, speed: float, acceleration: float | None) -> Profile:
    if acceleration is None:
        return constant_speed(length, speed)
    return trapezoid(length, speed, acceleration)
