"""Contour error, eq. (17), and overshoot at the corners of a path.

The contour error is the distance from the ideal corner to the trajectory along the 45-degree line
through it, positive to the inside; the overshoot is the largest excursion beyond the line of the
side that leaves the corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.recording.record import Recording
from corexy_fmi.rectangle import TURNS, Rectangle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Corner:
    """One corner: number from 1, time of the command [s], turn, errors [m] (NaN: not crossed)."""

    number: int
    time: float
    turn: str
    contour_error: float
    overshoot: float


def corner_table(
    recording: Recording, rectangle: Rectangle, times: Array | None = None
) -> tuple[Corner, ...]:
    """The 4 loops - 1 corners of a rectangle run, from its x, y; blank samples are passed over.

    ``times`` (4 loops + 1,) [s] are those of the vertices, where the run did not keep its own.
    """
    taken = ~(np.isnan(recording["x"]) | np.isnan(recording["y"]))
    time = recording.time[taken]
    path = np.column_stack([recording["x"][taken], recording["y"][taken]])
    vertices = rectangle.vertices
    times = rectangle.vertex_times if times is None else times
    middles = (times[:-1] + times[1:]) / 2
    corners = []
    for index in range(1, len(vertices) - 1):
        near = _between(time, path, middles[index - 1], middles[index])
        incoming = vertices[index] - vertices[index - 1]
        outgoing = vertices[index + 1] - vertices[index]
        corners.append(
            Corner(
                number=index,
                time=float(times[index]),
                turn=TURNS[(index - 1) % 2],
                contour_error=contour_error(near, vertices[index], incoming, outgoing),
                overshoot=overshoot(near, vertices[index], incoming),
            )
        )
    return tuple(corners)


def passing_times(recording: Recording, rectangle: Rectangle, pulley_radius: float) -> Array:
    """When the phi1, phi2 [rad] of a whole run pass each vertex, (4 loops + 1,) in s."""
    angles = np.column_stack([recording["phi1"], recording["phi2"]])
    # both motors' way is sqrt(2) times the head's
    steps = np.hypot(*np.diff(angles, axis=0).T) * pulley_radius / np.sqrt(2)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    sides = np.hypot(*np.diff(rectangle.vertices, axis=0).T)
    marks = np.concatenate([[0.0], np.cumsum(sides)])
    return np.interp(marks * way[-1] / marks[-1], way, recording.time)


def contour_error(
    path: Array, corner: Sequence[float] | Array, incoming: Array, outgoing: Array
) -> float:
    """Eq. (17) [m] of a path (n, 2) at an ideal corner between two directions (2,).

    Of several crossings of the 45-degree line the one nearest the corner; linear between rows; NaN
    where the path never crosses the line.
    """
    u, v = _unit(incoming), _unit(outgoing)
    away = path - np.asarray(corner, dtype=float)
    across, inside = away @ (u + v) / np.sqrt(2), away @ (v - u) / np.sqrt(2)
    crossed = np.flatnonzero(across[:-1] * across[1:] < 0)
    share = across[crossed] / (across[crossed] - across[crossed + 1])
    met = inside[crossed] + share * (inside[crossed + 1] - inside[crossed])
    met = np.concatenate([met, inside[across == 0]])
    return float(met[np.argmin(np.abs(met))]) if len(met) else float("nan")


def overshoot(path: Array, corner: Sequence[float] | Array, incoming: Array) -> float:
    """Largest excursion [m] of a path (n, 2) beyond the corner in its old direction, at least 0."""
    beyond = (path - np.asarray(corner, dtype=float)) @ _unit(incoming)
    return float(max(beyond.max(initial=0.0), 0.0))


def _between(time: Array, path: Array, start: float, end: float) -> Array:
    """The path between two times, its ends interpolated, (n, 2)."""
    inner = (time > start) & (time < end)
    ends = np.array([[np.interp(t, time, path[:, i]) for i in (0, 1)] for t in (start, end)])
    return np.concatenate([ends[:1], path[inner], ends[1:]])


def _unit(direction: Array) -> Array:
    return np.asarray(direction, dtype=float) / np.linalg.norm(direction)
