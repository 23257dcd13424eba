"""Short motions that bring effects out: reversals, strokes, circles, shaking, within given limits.

Every program starts and ends at rest at the origin, lasts at most `LONGEST` seconds, and stays
within the box, the speed and the acceleration that it is given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.motion import (
    Motion,
    chain,
    chirp,
    circle,
    command,
    half_stage,
    line,
    place,
    rest,
    star,
)
from corexy_fmi.recording import Recording, inputs
from corexy_fmi.shake import shake, slowest

LONGEST = 10.0  # [s]
PAUSE = 0.2  # [s] of rest where a program turns to something else
SLOWEST = 1e-3  # [m/s]
SHRINK, LEAST = 0.8, 1e-4  # factor by which a motion that takes too long shrinks; smallest size [m]
SHARE = 0.8  # of the stage that a program uses
WINDOW = 0.01  # [s] over which a recorded acceleration is taken
AXES = ((1, 0), (0, 1), (1, 1))
TURNS = 3.2  # [s] of a sweep along each of three axes
BANDS = {"slow shaking": 12.0, "shaking": 30.0, "quick shaking": 75.0}  # up to so many Hz
WIDEST = 1.5  # times its lowest frequency is its highest, at least
SOFTER = (1.0, 0.5, 0.25)  # of the acceleration


@dataclass(frozen=True)
class Limits:
    """Reach [m] of either axis from the origin, path speed [m/s] and acceleration [m/s^2].

    Raises InputError for what is not positive.
    """

    x: float
    y: float
    speed: float
    acceleration: float

    def __post_init__(self) -> None:
        for name in ("x", "y", "speed", "acceleration"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name}: found {value!r}, expected a positive number")


def stage_limits(machine: Machine, speed: float, acceleration: float) -> Limits:
    """The stage of a machine, with a margin, at a speed and an acceleration."""
    wide, high = half_stage(machine)
    return Limits(SHARE * wide, SHARE * high, speed, acceleration)


def recorded_limits(recordings: list[Recording], machine: Machine) -> Limits:
    """What recordings of commanded angles have shown a machine to bear: nothing beyond it."""
    radius = machine.parameters["pulley_radius"]
    reach, speed, acceleration = np.zeros(2), 0.0, 0.0
    for recording in recordings:
        given = inputs(recording)
        grid = np.arange(recording.time[0], recording.time[-1], WINDOW)
        path = place(given["phi1"], given["phi2"], radius)
        even = np.array([np.interp(grid, recording.time, p) for p in path])
        velocity = np.diff(even, axis=1) / WINDOW
        change = np.diff(velocity, axis=1) / WINDOW
        reach = np.maximum(reach, np.abs(path).max(axis=1))
        speed = max(speed, float(np.linalg.norm(velocity, axis=0).max(initial=0.0)))
        acceleration = max(acceleration, float(np.linalg.norm(change, axis=0).max(initial=0.0)))
    return Limits(float(reach[0]), float(reach[1]), speed, acceleration)


def programs(limits: Limits) -> dict[str, Motion]:
    """All programs by name."""
    x, y, a = limits.x, limits.y, limits.acceleration
    fast, slow = limits.speed, max(limits.speed / 10, SLOWEST)
    small = min(x, y)
    return {
        "strokes": _fitted(lambda k: _strokes(k * x, k * y, fast, a)),
        "slow strokes": _fitted(lambda k: _strokes(k * x, k * y, fast / 3, a)),
        "strokes along x": _fitted(lambda k: _through([(k * x, 0), (-k * x, 0), (0, 0)], fast, a)),
        "strokes along y": _fitted(lambda k: _through([(0, k * y), (0, -k * y), (0, 0)], fast, a)),
        "slow reversals": _fitted(lambda k: _reversals(k * small / 5, slow, a)),
        "quick reversals": _fitted(lambda k: _reversals(k * small / 3, fast, a)),
        "star": _fitted(lambda k: star(k * small, 8, fast, a)),
        "slow star": _fitted(lambda k: star(k * small / 2, 8, fast / 4, a)),
        "circles": _fitted(lambda k: _circles(k * small, fast, a)),
        "sweep": _sweep(small, fast, a),
    }


def shakings(limits: Limits) -> dict[str, tuple[Motion, ...]]:
    """Shaking over some bands by name, each from hard to soft: a stage may ring at any of them."""
    small, speed = min(limits.x, limits.y), limits.speed
    return {
        name: tuple(_shaking(small, speed, share * limits.acceleration, top) for share in SOFTER)
        for name, top in BANDS.items()
    }


def named_command(name: str, motion: Motion, machine: Machine, rate: float = 1000.0) -> Recording:
    """The angles that command a program, as a recording of that name."""
    return command(motion, machine.parameters["pulley_radius"], rate, name)


def _fitted(make: Callable[[float], Motion]) -> Motion:
    """The largest of a family of motions that keeps the time."""
    size = 1.0
    while (motion := make(size)).duration > LONGEST and size > LEAST:
        size *= SHRINK
    return motion


def _strokes(x: float, y: float, speed: float, acceleration: float) -> Motion:
    """Along each axis from end to end, then across."""
    ends = [(x, 0), (-x, 0), (0, 0), (0, y), (0, -y), (0, 0), (x, y), (-x, -y), (0, 0)]
    return _through(ends, speed, acceleration)


def _reversals(size: float, speed: float, acceleration: float) -> Motion:
    """To and fro around the origin: x, y, and either motor alone."""
    ends: list[tuple[float, float]] = []
    for ax, ay in ((1, 0), (0, 1), (0.7, 0.7), (0.7, -0.7)):
        ends += [(size * ax, size * ay), (-size * ax, -size * ay)] * 2 + [(0, 0)]
    return _through(ends, speed, acceleration)


def _through(ends: list[tuple[float, float]], speed: float, acceleration: float) -> Motion:
    moves, here = [rest((0, 0), PAUSE)], (0.0, 0.0)
    for end in ends:
        moves.append(line(here, end, speed, acceleration))
        here = end
    return chain(*moves, rest(here, PAUSE))


def _circles(radius: float, speed: float, acceleration: float) -> Motion:
    """A large circle and a small one, no faster than their bend allows."""
    moves: list[Motion] = [rest((0, 0), PAUSE)]
    for r in (radius, radius / 4):
        bent = min(speed, float(np.sqrt(acceleration * r)))
        moves += [line((0, 0), (r, 0), speed, acceleration), circle(r, bent, 1, acceleration),
                  line((r, 0), (0, 0), speed, acceleration)]  # fmt: skip
    return chain(*moves, rest((0, 0), PAUSE))


def _sweep(reach: float, speed: float, acceleration: float) -> Motion:
    """A sine of rising frequency along x, then along y, then along both."""
    highest = 12.0  # [Hz]
    turning = 2 * np.pi * highest
    size = min(reach / 2, speed / turning, acceleration / turning**2)
    return chain(*[chirp(axis, size, (1.0, highest), TURNS) for axis in AXES])


def _shaking(reach: float, speed: float, acceleration: float, top: float) -> Motion:
    """The same at one acceleration, from the lowest frequency that speed and reach allow."""
    first = slowest(acceleration, speed, reach / 2)
    band = (first, max(top, WIDEST * first))
    return chain(*[shake(axis, acceleration, band, TURNS) for axis in AXES])
