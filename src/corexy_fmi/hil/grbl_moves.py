"""Commanded angles as short straight moves between whole steps, and as lines of G-code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.recording import Recording, inputs

Array = NDArray[np.float64]
SHORT, LONGEST = 25e-3, 0.1  # [s] of a move: shorter only at corners, longer only where straight
ON_PATH, ON_TIME = 0.5, 0.25  # [steps] from the path; from the place at each moment
PAUSE = 0.1  # [s] without a step that is a rest, not a slow motion


class Move(NamedTuple):
    """To a place in steps of the machine's x and y, in a time; without way it is a rest."""

    seconds: float
    x: int
    y: int


@dataclass(frozen=True)
class Grid:
    """Steps of a millimetre, and where in them the stage's centre lies."""

    per_mm: float
    centre: tuple[int, int]

    def steps(self, place: tuple[float, float]) -> tuple[int, int]:
        """The whole steps next to a machine position [mm]."""
        return round(place[0] * self.per_mm), round(place[1] * self.per_mm)

    def metres(self, steps: Array) -> Array:
        """Stage positions (n, 2) [m] of steps (n, 2)."""
        return (np.asarray(steps, dtype=float) - self.centre) / self.per_mm / 1e3


def moves(order: Recording, radius: float, grid: Grid) -> tuple[tuple[int, int], list[Move]]:
    """First place [steps], and the moves of a command, phi1 and phi2 [rad], eq. (1)."""
    given = inputs(order)
    phi1, phi2 = given["phi1"], given["phi2"]
    path = np.column_stack([phi1 + phi2, phi1 - phi2]) * (500 * radius * grid.per_mm)
    path += np.array(grid.centre)
    stops = np.rint(path).astype(int)
    made: list[Move] = []
    for first, last in _spans(order.time, path):
        made.append(Move(float(order.time[last] - order.time[first]), *stops[last].tolist()))
    start = int(stops[0, 0]), int(stops[0, 1])
    return start, _rested(start, made)


def _spans(time: Array, path: Array) -> list[tuple[int, int]]:
    """Pairs of rows between which the path is straight, and evenly driven as far as time allows."""
    spans, first = [], 0
    while first < len(time) - 1:
        last = first + 1
        while last + 1 < len(time) and _straight(time[first : last + 2], path[first : last + 2]):
            last += 1
        spans.append((first, last))
        first = last
    return spans


def _straight(time: Array, path: Array) -> bool:
    span = time[-1] - time[0]
    if span > LONGEST:
        return False
    inner, chord = path[1:-1] - path[0], path[-1] - path[0]
    if span > SHORT:
        share = (time[1:-1] - time[0]) / span
        return bool(np.abs(inner - share[:, None] * chord).max() <= ON_TIME)
    square = float(chord @ chord)
    share = np.clip(inner @ chord / square, 0, 1) if square else np.zeros(len(inner))
    return bool(np.hypot(*(inner - share[:, None] * chord).T).max() <= ON_PATH)


def _rested(start: tuple[int, int], made: Sequence[Move]) -> list[Move]:
    """Moves without way: one rest where they last, else time of the next move."""
    done: list[Move] = []
    place, waited = start, 0.0
    for move in made:
        if move[1:] == place:
            waited += move.seconds
            continue
        if waited >= PAUSE:
            done.append(Move(waited, *place))
            waited = 0.0
        done.append(Move(move.seconds + waited, move.x, move.y))
        place, waited = (move.x, move.y), 0.0
    return [*done, Move(waited, *place)] if waited else done


def straight(start: tuple[int, int], goal: tuple[int, int], speed: float, grid: Grid) -> list[Move]:
    """To a goal [steps] at a speed [m/s], in moves short enough that a lost host leaves few."""
    way = float(np.hypot(goal[0] - start[0], goal[1] - start[1])) / grid.per_mm / 1e3
    count = int(np.ceil(way / speed / LONGEST))
    stops = np.rint(np.linspace(start, goal, count + 1)[1:]).astype(int).tolist()
    return [Move(way / speed / count, x, y) for x, y in stops]


def program(
    start: tuple[int, int],
    made: Sequence[Move],
    grid: Grid,
    offset: tuple[float, float],
    feed_factor: float,
) -> list[str]:
    """G-code lines for absolute mm in the work coordinates of an ``offset`` [mm].

    Every move has its own feed, so that it takes its time: G94 with the family's factor.  Inverse
    time (G93) would need the factor elsewhere: see `Build.feed_factor`.
    """
    lines, place = [], start
    for move in made:
        way = float(np.hypot(move.x - place[0], move.y - place[1])) / grid.per_mm
        if way == 0:
            lines.append(f"G4P{move.seconds:.3f}")
            continue
        x, y = (f"{steps / grid.per_mm - o:.4f}" for steps, o in zip(move[1:], offset, strict=True))
        lines.append(f"G1X{x}Y{y}F{60 * way / move.seconds * feed_factor:.2f}")
        place = move.x, move.y
    return lines
