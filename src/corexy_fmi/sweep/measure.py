"""Corner errors, overshoot and settling of many paths at once; the same as `corners`, by arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.rectangle import REST, TURNS, Rectangle

Array = NDArray[np.float64]
SHORT = {"x->y": "xy", "y->x": "yx"}
MEASURES = {
    "contour_error_xy": "m",
    "contour_error_yx": "m",
    "overshoot_xy": "m",
    "overshoot_yx": "m",
    "settling": "s",
}


@dataclass(frozen=True, eq=False)
class Window:
    """A corner [m], its sides' unit vectors, its turn, and the rows from middle to middle."""

    corner: Array
    incoming: Array
    outgoing: Array
    turn: str
    rows: slice
    ends: tuple[tuple[int, float], tuple[int, float]]  # row before each end, share of its interval

    def of(self, paths: Array) -> Array:
        """The pieces (sets, 2, n) of paths (sets, 2, rows), ends interpolated, from the corner."""
        first, last = (
            paths[..., k] + w * (paths[..., k + 1] - paths[..., k]) for k, w in self.ends
        )
        piece = np.concatenate([first[..., None], paths[..., self.rows], last[..., None]], axis=-1)
        return np.asarray(piece - self.corner[:, None])


def windows(shape: Rectangle, time: Array) -> list[Window]:
    """All corners of a run with rows at ``time`` (n,) [s]."""
    vertices, times = shape.vertices, shape.vertex_times
    middles, sides = (times[:-1] + times[1:]) / 2, np.diff(vertices, axis=0)
    ways = sides / np.linalg.norm(sides, axis=1)[:, None]
    found = []
    for n in range(1, len(vertices) - 1):
        start, end = middles[n - 1], middles[n]
        rows = slice(
            int(np.searchsorted(time, start, side="right")), int(np.searchsorted(time, end))
        )
        ends = (_before(time, start), _before(time, end))
        turn = TURNS[(n - 1) % 2]
        found.append(Window(vertices[n], ways[n - 1], ways[n], turn, rows, ends))
    return found


def measured(
    shape: Rectangle, corners: list[Window], time: Array, paths: Array, within: float
) -> dict[str, Array]:
    """`MEASURES` of paths (sets, 2, rows) [m], each (sets,); of several corners the worst.

    ``settling`` [s] is counted from the end of the command; NaN where a path is still farther than
    ``within`` [m] from its last place in the last tenth of the rest.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a run that broke down is not finite
        found: dict[str, Array] = {}
        for turn in TURNS:
            pieces = [(c, c.of(paths)) for c in corners if c.turn == turn]
            errors = np.array([contour_errors(c, piece) for c, piece in pieces])
            beyond = [
                np.maximum(_along(piece, c.incoming).max(axis=-1), 0.0) for c, piece in pieces
            ]
            found[f"contour_error_{SHORT[turn]}"] = _worst(errors)
            found[f"overshoot_{SHORT[turn]}"] = np.max(beyond, axis=0)
        found["settling"] = settling(paths, time, float(shape.vertex_times[-1]), within)
    return {name: found[name] for name in MEASURES}


def contour_errors(corner: Window, piece: Array) -> Array:
    """Eq. (17) [m] of pieces (sets, 2, n), (sets,); NaN where the 45-degree line is not crossed."""
    across = _along(piece, (corner.incoming + corner.outgoing) / np.sqrt(2))
    inside = _along(piece, (corner.outgoing - corner.incoming) / np.sqrt(2))
    which, row = np.nonzero(across[:, :-1] * across[:, 1:] < 0)
    here, there = across[which, row], across[which, row + 1]
    met = inside[which, row]
    met = met + here / (here - there) * (inside[which, row + 1] - met)
    upon = np.nonzero(across == 0)
    which, met = np.concatenate([which, upon[0]]), np.concatenate([met, inside[upon]])
    nearest_last = np.argsort(-np.abs(met), kind="stable")
    found = np.full(len(piece), np.nan)
    found[which[nearest_last]] = met[nearest_last]
    return found


def settling(paths: Array, time: Array, end: float, within: float) -> Array:
    """Time [s] from ``end`` until paths (sets, 2, rows) stay within a distance of their last place.

    (sets,); NaN where that is not before the last tenth of the rest.
    """
    first = int(np.searchsorted(time, end - 1e-9))
    left, after = paths[..., first:] - paths[..., -1:], time[first:]
    outside = ~(left[:, 0] ** 2 + left[:, 1] ** 2 <= within**2)
    last = outside.shape[1] - 1 - np.argmax(outside[:, ::-1], axis=1)
    still = np.append(after[1:], np.inf)[last] - end
    found = np.where(outside.any(axis=1), still, 0.0)
    return np.where(found <= 0.9 * REST, found, np.nan)


def _worst(errors: Array) -> Array:
    """Of (corners, sets) the one of largest size, its sign kept; NaN where one is."""
    place = np.argmax(np.where(np.isnan(errors), np.inf, np.abs(errors)), axis=0)
    return np.asarray(errors[place, np.arange(errors.shape[1])])


def _along(piece: Array, way: Array) -> Array:
    """Component (sets, n) of pieces (sets, 2, n) along a direction (2,)."""
    return np.asarray(piece[:, 0] * way[0] + piece[:, 1] * way[1])


def _before(time: Array, instant: float) -> tuple[int, float]:
    """The row before an instant, and the share of the interval behind it."""
    row = min(max(int(np.searchsorted(time, instant, side="right")) - 1, 0), len(time) - 2)
    return row, float((instant - time[row]) / (time[row + 1] - time[row]))
