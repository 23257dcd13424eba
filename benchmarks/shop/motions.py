"""Motions of a workshop: waypoints, trapezia of speed, in metres and seconds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.shop.stage import Array

Motion = tuple[Array, Array]  # time [s], x and y [m] of each row
Points = Sequence[tuple[float, float]] | Array
RADIUS, ROW = 5e-3, 2e-3  # of the pulleys [m]; between rows [s]
LEAD, TAIL, REST = 0.3, 0.5, 0.15  # at rest before, after and between the moves [s]


def angles(xy: Array, radius: float = RADIUS) -> Array:
    """Motor angles of positions, (1)."""
    return np.column_stack([xy[:, 0] + xy[:, 1], xy[:, 0] - xy[:, 1]]) / radius


def timed(xy: Array, row: float) -> Motion:
    """Positions with their time, a row every so many seconds."""
    return np.arange(len(xy), dtype=np.float64) * row, xy


def along(length: float, speed: float, accel: float, row: float) -> Array:
    """The way gone along one move, row by row."""
    speed = min(speed, float(np.sqrt(length * accel)))
    ramp, takes = speed / accel, length / speed + speed / accel
    t = np.minimum(np.arange(1, int(np.ceil(takes / row)) + 1) * row, takes)
    slowing = length - accel * (takes - t) ** 2 / 2
    even = speed * (t - ramp / 2)
    return np.where(t < ramp, accel * t**2 / 2, np.where(t < takes - ramp, even, slowing))


def path(
    points: Points, speed: float | Sequence[float] | Array, accel: float = 3.0,
    rest: float = REST, lead: float = LEAD, row: float = ROW,
) -> Motion:  # fmt: skip
    """From point to point, with a stop at each; a speed for all moves or one for each."""
    at = np.asarray(points, float)
    speeds = np.broadcast_to(speed, len(at) - 1) if np.ndim(speed) == 0 else np.asarray(speed)
    parts = [np.repeat(at[:1], int(lead / row), 0)]
    for a, b, v in zip(at, at[1:], speeds, strict=False):
        length = float(np.hypot(*(b - a)))
        if length > 0:
            parts.append(a + (b - a) * (along(length, v, accel, row) / length)[:, None])
            parts.append(np.repeat(b[None], int(rest / row), 0))
    parts.append(np.repeat(at[-1:], int(TAIL / row), 0))
    return timed(np.concatenate(parts), row)


def scattered(seed: int, count: int, width: float = 0.06, height: float = 0.08) -> Array:
    """From the middle to points drawn from a seed."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(-width, width, count), random.uniform(-height, height, count)
    return np.vstack([[0, 0], np.column_stack([x, y])])


def rectangle(width: float, height: float, way: int = 1) -> list[tuple[float, float]]:
    """Round once, about the middle; backwards with ``way`` -1."""
    w, h = width / 2, height / 2
    corners = [(-w, -h), (w, -h), (w, h), (-w, h)][::way]
    begin = corners.index((-w, -h))
    return [*corners[begin:], *corners[:begin], (-w, -h)]


def both_ways() -> Array:
    """Two rectangles, the second the other way round."""
    return np.array(rectangle(0.08, 0.06) + rectangle(0.05, 0.1, -1))


def usual() -> list[Motion]:
    """Scattered points at changing speeds, two rectangles; other points are kept back."""
    speeds = np.random.default_rng(3).uniform(0.5, 1.3, 20) * 0.06
    first = path(scattered(3, 9), speeds)
    return [first, path(both_ways(), 0.072), path(scattered(12, 9), 0.06)]


def longer() -> list[Motion]:
    """As `usual`, more points and slower."""
    speeds = np.random.default_rng(50).uniform(0.5, 1.3, 15) * 0.04
    first = path(scattered(1, 14), speeds)
    return [first, path(both_ways(), 0.08), path(scattered(2, 10), 0.06)]


def printing() -> list[Motion]:
    """As a printer: infill to and fro with circles, travels and short moves, a star."""
    infill = [(0.0, 0.0)]
    for k in range(12):
        x, y = (-0.02 if k % 2 else 0.02), -0.015 + 0.0012 * k
        infill += [(x, y), (x, y + 0.0006)]
    corners = [(0, 0), (0.08, 0.05), (0.06, 0.05), (0.06, 0.045), (-0.08, -0.06), (-0.07, -0.06)]
    speeds = [0.15, 0.03, 0.03, 0.15, 0.03, 0.15]
    ends = [((-1, 1)[k % 2], k) for k in range(14)]
    star = [(0.0, 0.0), *((0.015 * way + 0.001 * k, 0.015 * way) for way, k in ends)]
    return [
        _with_circles(path(infill, 0.05, 2.0, rest=0), 0.004, 6, 0.02),
        path([*corners, (0, 0.07)], speeds, 3.0, rest=0.05),
        path(star, 0.05, 2.0, rest=0),
    ]


def _with_circles(motion: Motion, radius: float, turns: int, speed: float) -> Motion:
    """Circles from where a motion ends."""
    turn = np.linspace(0, 2 * np.pi * turns, int(2 * np.pi * radius * turns / speed / ROW))
    circles = radius * np.column_stack([np.cos(turn) - 1, np.sin(turn)]) + motion[1][-1]
    return timed(np.vstack([motion[1], circles, np.repeat(circles[-1:], 150, 0)]), ROW)


def slow() -> list[Motion]:
    """Small and slow, as when one looks for sticking; rows every 4 ms."""
    first, kept = (scattered(seed, 4, 0.015, 0.02) for seed in (21, 22))
    rows = (first, 0.012), (np.array(rectangle(0.02, 0.016)), 0.008), (kept, 0.012)
    return [path(points, speed, 2.0, row=4e-3) for points, speed in rows]


def one_way() -> list[Motion]:
    """Always towards +x and +y."""
    steps = [(-0.07, -0.08), (-0.05, -0.05), (-0.02, -0.05), (-0.02, -0.01), (0.03, 0.03)]
    corner = [(-0.07, -0.08), (0.0, -0.08), (0.0, 0.08), (0.06, 0.08)]
    kept = [(-0.07, -0.08), (-0.07, 0.03), (0.05, 0.03), (0.07, 0.08)]
    first = path([*steps, (0.07, 0.08)], [0.04, 0.06, 0.05, 0.07, 0.03], rest=0.2)
    return [first, path(corner, 0.05), path(kept, 0.06)]


def ramped(accel: float, *, halfway: bool) -> list[tuple[Motion, Motion]]:
    """What is logged, at constant speed, and what a controller makes of it, with ramps; the log
    begins with the ramp, or at its middle.
    """
    found = []
    for points, v in ((scattered(3, 9), 0.06), (both_ways(), 0.05), (scattered(12, 9), 0.05)):
        lead = LEAD + (v / accel / 2 if halfway else 0.0)
        logged = path(points, v, 1e4, rest=REST + v / accel, lead=lead)
        played = path(points, v, accel)
        n = min(len(logged[0]), len(played[0]))
        pair = [(t[:n], xy[:n]) for t, xy in (logged, played)]
        found.append((pair[0], pair[1]))
    return found
