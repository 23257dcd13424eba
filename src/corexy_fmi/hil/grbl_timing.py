"""When a GRBL controller passes where: its planner's speeds at junctions and on ramps, foreseen.

A controller slows down at corners and starts from rest, so a command at constant speed is not what
it drives.  Planner of GRBL 1.1 (`planner.c`): lengths, limits and junctions in the space of the
motors; speeds at junctions by junction deviation; backward and forward pass.  Its ramps advance in
pieces of 10 ms of even speed; here they are smooth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.hil.grbl_moves import Grid, Move

Array = NDArray[np.float64]
DEVIATION = 0.01  # [mm] of GRBL where $11 is not told
Piece = tuple[float, Array, Array, tuple[float, float, float]]  # duration, then a row of Timeline
SHARP, SAME = 0.999999, -0.999999  # cosines beyond which a junction is a turn-back, or none


@dataclass(frozen=True)
class Blocks:
    """Moves in a row without rest: ``way`` (n, 2) [mm] of both motors, ``speed`` (n,) [mm/s]."""

    way: Array
    speed: Array
    rates: Array
    accelerations: Array
    deviation: float
    ahead: int

    @property
    def length(self) -> Array:
        """Along both motors (n,) [mm]."""
        return np.hypot(*self.way.T)

    @property
    def unit(self) -> Array:
        """Directions (n, 2)."""
        return self.way / self.length[:, None]

    @property
    def acceleration(self) -> Array:
        """Along each block (n,) [mm/s^2], so that no motor exceeds its own."""
        return _limited(self.unit, self.accelerations)

    def nominal(self) -> Array:
        """Asked, or the most that the motors may, (n,) [mm/s]."""
        return np.minimum(self.speed, _limited(self.unit, self.rates))

    def entries(self) -> Array:
        """Speeds at the n + 1 ends of blocks [mm/s]."""
        nominal, unit = self.nominal(), self.unit
        top = np.zeros(len(nominal) + 1)
        for k in range(1, len(nominal)):
            top[k] = min(nominal[k - 1], nominal[k], self._junction(unit[k - 1], unit[k]))
        room = 2 * self.acceleration * self.length
        for k in range(len(nominal) - 1, -1, -1):  # what can be braked to the end of its buffer
            top[k] = min(top[k], np.sqrt(top[k + 1] ** 2 + room[k]),
                         np.sqrt(room[k : k + self.ahead].sum()))  # fmt: skip
        for k in range(len(nominal)):
            top[k + 1] = min(top[k + 1], np.sqrt(top[k] ** 2 + room[k]))
        return top

    def _junction(self, before: Array, after: Array) -> float:
        cosine = -float(before @ after)
        if cosine > SHARP:
            return 0.0
        if cosine < SAME:
            return np.inf
        turn = (after - before) / np.linalg.norm(after - before)
        half = np.sqrt(0.5 * (1 - cosine))
        acceleration = _limited(turn[None, :], self.accelerations)[0]
        return float(np.sqrt(acceleration * self.deviation * half / (1 - half)))


def _limited(unit: Array, most: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.min(most / np.abs(unit), axis=1)


@dataclass(frozen=True)
class Timeline:
    """Pieces of even acceleration: begins [s], then way [steps] at x0 + share * dx."""

    begins: Array  # (n + 1,), the last is the end
    origin: Array  # (n, 2)
    way: Array  # (n, 2)
    share: Array  # (n, 3): of the way, at begin, its first and half its second derivative

    @property
    def end(self) -> float:
        """Duration [s]."""
        return float(self.begins[-1])

    def place(self, time: Array) -> Array:
        """Steps (n, 2) at times (n,) [s]; at rest before and after."""
        time = np.clip(time, 0.0, self.end)
        k = np.clip(np.searchsorted(self.begins, time, side="right") - 1, 0, len(self.way) - 1)
        tau = time - self.begins[k]
        share = self.share[k, 0] + tau * (self.share[k, 1] + tau * self.share[k, 2])
        result: Array = self.origin[k] + share[:, None] * self.way[k]
        return result


def timeline(
    start: tuple[int, int], made: Sequence[Move], grid: Grid, settings: Mapping[int, float],
    ahead: int,
) -> Timeline:  # fmt: skip
    """Of moves with rests between, on a controller with these settings that plans so far ahead.

    There must be a move.
    """
    starts = [start, *((move.x, move.y) for move in made)]
    rows: list[Piece] = []
    for resting, group in groupby(zip(starts, made, strict=False), lambda p: p[1][1:] == p[0]):
        stretch = list(group)
        place = np.array(stretch[0][0], dtype=float)
        row = [move for _, move in stretch]
        if resting:
            rows += [(move.seconds, place, np.zeros(2), (0.0, 0.0, 0.0)) for move in row]
        else:
            rows += _driven(place, row, grid, settings, ahead)
    seconds, origins, ways, shares = zip(*rows, strict=True)
    begins = np.concatenate([[0.0], np.cumsum(seconds)])
    return Timeline(begins, np.array(origins), np.array(ways), np.array(shares))


def _driven(
    place: Array, row: Sequence[Move], grid: Grid, settings: Mapping[int, float], ahead: int
) -> list[Piece]:
    """The pieces of moves in a row: speed up, even, slow down, each where there is one."""
    goals = np.array([move[1:] for move in row], dtype=float)
    ends = np.vstack([place, goals])
    steps = np.diff(ends, axis=0)
    way = np.column_stack([steps.sum(axis=1), steps[:, 0] - steps[:, 1]]) / grid.per_mm
    asked = np.hypot(*way.T) / np.array([move.seconds for move in row])
    rates = np.array([settings[110], settings[111]]) / 60
    limits = np.array([settings[120], settings[121]])
    blocks = Blocks(way, asked, rates, limits, settings.get(11, DEVIATION), ahead)
    pieces: list[Piece] = []
    speeds, nominal = blocks.entries(), blocks.nominal()
    for k, length in enumerate(blocks.length):
        done = 0.0
        for seconds, speed, ramp in _ramps(
            length, speeds[k], nominal[k], speeds[k + 1], blocks.acceleration[k]
        ):
            share = (done / length, speed / length, ramp / 2 / length)
            pieces.append((seconds, ends[k], steps[k], share))
            done += seconds * (speed + ramp * seconds / 2)
    return pieces


def _ramps(
    length: float, enter: float, nominal: float, leave: float, acceleration: float
) -> list[tuple[float, float, float]]:
    """Seconds, first speed and acceleration of up to three pieces."""
    peak = min(nominal, np.sqrt(acceleration * length + (enter**2 + leave**2) / 2))
    peak = max(peak, enter, leave)
    even = length - (2 * peak**2 - enter**2 - leave**2) / (2 * acceleration)
    pieces = [
        ((peak - enter) / acceleration, enter, acceleration),
        (max(even, 0.0) / peak, peak, 0.0),
        ((peak - leave) / acceleration, peak, -acceleration),
    ]
    return [piece for piece in pieces if piece[0] > 0]
