"""Motions drawn for a machine: six kinds, 6 to 14 s, at speeds and accelerations for it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.shop.motions import LEAD, REST, TAIL, Motion, along, path, rectangle, timed
from benchmarks.shop.stage import Array
from benchmarks.strange.machines import Machine, Random, spread

SPEED, ACCEL = (0.05, 0.5), (0.5, 8.0)  # [m/s], [m/s^2]
STRETCH, LAG = 1e-3, 3e-3  # [m] that belts give at most: to inertia, to viscous friction
SECONDS, LONGEST = (6.5, 12.5), 14.0  # of a recording [s]: asked, at most
MOVES = 1500  # of a program, of which as many are played as there is time for
Kind = Callable[[Random, Array, Array], Array]  # middle, half of the size [m] -> points


def _rectangles(random: Random, middle: Array, half: Array) -> Array:
    loops = []
    for k in range(MOVES // 5):
        width, height = 2 * half * random.uniform(0.4, 1.0, 2)
        loops += rectangle(width, height, 1 - 2 * (k % 2))
    return middle + np.array(loops)


def _zigzag(random: Random, middle: Array, half: Array) -> Array:
    """To and fro along one axis, on by a step along the other, and back from its end."""
    axis, lanes = int(random.integers(2)), int(random.integers(5, 15))
    k = np.arange(MOVES)
    across = np.where(k % 4 < 2, -1.0, 1.0) * np.where(k % 2, -1.0, 1.0)
    lane = np.abs((k // 2 + lanes) % (2 * lanes) - lanes) / lanes * 2 - 1
    pair = across, lane
    return middle + half * np.column_stack(pair if axis == 0 else pair[::-1])


def _scattered(random: Random, middle: Array, half: Array) -> Array:
    return middle + half * random.uniform(-1, 1, (MOVES, 2))


def _star(random: Random, middle: Array, half: Array) -> Array:
    """From the middle to its rays' ends and back."""
    rays, k = int(random.integers(5, 13)), np.arange(MOVES)
    angle = 2 * np.pi * (k // 2) * int(random.integers(2, 5)) / rays + random.uniform(0, 1)
    out = np.column_stack([np.cos(angle), np.sin(angle)]) * (k % 2)[:, None]
    return middle + half * out


def _printing(random: Random, middle: Array, half: Array) -> Array:
    """Short moves in patches, with a travel from each to the next."""
    points: list[Array] = []
    while len(points) < MOVES:
        at, size = half * random.uniform(-0.8, 0.8, 2), random.uniform(2e-3, 10e-3)
        for k in range(int(random.integers(6, 20))):
            here = at + np.array([size * (1 - 2 * (k % 2)), random.uniform(3e-4, 1e-3) * k])
            points.append(np.clip(here, -half, half))
    return middle + np.array(points)


KINDS: dict[str, Kind] = {"rectangles": _rectangles, "zigzag": _zigzag, "scattered": _scattered,
                          "star": _star, "printing": _printing}  # fmt: skip
NAMES = (*KINDS, "circles")


def limits(machine: Machine) -> tuple[float, float]:
    """Most speed [m/s] and acceleration [m/s^2]."""
    omega, damping = machine.modes.omega, machine.modes.damping
    speed = float((LAG * omega / (2 * damping)).min())
    return min(SPEED[1], speed), min(ACCEL[1], STRETCH * float(omega.min()) ** 2)


def _in_time(points: Array, speeds: Array, accel: float, rest: float, seconds: float) -> int:
    """How many moves take so long, and no more than the longest recording."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    fast = np.minimum(speeds, np.sqrt(lengths * accel))
    takes = np.where(lengths > 0, lengths / np.maximum(fast, 1e-9) + fast / accel + rest, 0.0)
    whole = LEAD + TAIL + np.cumsum(takes)
    enough, most = np.searchsorted(whole, [seconds, LONGEST - 0.1])
    return max(int(min(enough + 1, most)), 2)


def _circles(
    random: Random, middle: Array, half: Array, drive: tuple[float, float], row: float,
    seconds: float,
) -> Motion:  # fmt: skip
    """Circles of several sizes about the middle, either way round, one after the other."""
    speed, accel = drive[0], drive[1] / 1.5  # along and across at once
    at = middle + np.array([half.min(), 0.0])
    parts = [np.repeat(at[None], int(LEAD / row), 0)]
    while sum(map(len, parts)) * row < seconds - TAIL:
        radius, way = float(half.min()) * random.uniform(0.3, 1.0), random.choice([-1, 1])
        begin, even = middle + np.array([radius, 0.0]), min(speed, float(np.sqrt(accel * radius)))
        length = float(np.hypot(*(begin - at)))
        if length > 0:
            parts.append(at + (begin - at) * (along(length, speed, accel, row) / length)[:, None])
        turn = way * along(2 * np.pi * radius, even, accel, row) / radius
        parts.append(middle + radius * np.column_stack([np.cos(turn), np.sin(turn)]))
        at = parts[-1][-1]
        parts.append(np.repeat(at[None], int(REST / row), 0))
    parts.append(np.repeat(at[None], int(TAIL / row), 0))
    return timed(np.concatenate(parts), row)


def draw_motion(random: Random, machine: Machine, kind: str, row: float) -> Motion:
    """A motion of a kind, with a row every so many seconds."""
    fastest, hardest = limits(machine)
    speed, accel = spread(random, SPEED[0], fastest), spread(random, ACCEL[0], hardest)
    whole = np.array(machine.half)
    half = np.minimum(whole * random.uniform(0.3, 1.0, 2), 0.8 * speed)  # [m]; 0.8 s of travel
    middle, seconds = (whole - half) * random.uniform(-1, 1, 2), random.uniform(*SECONDS)
    if kind == "circles":
        small = np.minimum(half, 0.5 * speed)
        return _circles(random, middle, small, (speed, accel), row, min(seconds, 9.0))
    points = KINDS[kind](random, middle, half)
    speeds = speed * random.uniform(0.4, 1.0, len(points) - 1)
    rest = 0.0 if kind == "printing" else random.uniform(0.05, 0.3)
    count = _in_time(points, speeds, accel, rest, seconds)
    return path(points[: count + 1], speeds[:count], accel, rest=rest, row=row)


def draw_motions(random: Random, machine: Machine, row: float) -> list[Motion]:
    """Two to fit, one to judge on, each of another kind."""
    kinds = random.permutation(NAMES)[:3]
    return [draw_motion(random, machine, str(kind), row) for kind in kinds]
