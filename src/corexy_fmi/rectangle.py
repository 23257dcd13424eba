"""The rectangle run: centred, from bottom left, counter-clockwise, as in the paper's Fig. 3."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.motion import MOST_ROWS, RATE, Motion, chain, line, rest

REST = 0.5  # [s] at the end
SMALLEST = 1e-6  # [m] of a side
SIDE = 250  # rows that one side's motion takes as much memory as
TURNS = ("x->y", "y->x")


@dataclass(frozen=True)
class Rectangle:
    """A rectangle [m] driven at a speed [m/s]; without ``acceleration`` [m/s^2] at constant speed.

    Raises InputError for sizes and counts that are not positive, and for more than memory holds.
    """

    width: float
    height: float
    speed: float
    loops: int = 1
    acceleration: float | None = None

    def __post_init__(self) -> None:
        for name in ("width", "height", "speed"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name}: found {value!r}, expected a positive number")
        for name in ("width", "height"):
            if getattr(self, name) < SMALLEST:
                found = f"{name}: found {getattr(self, name)!r}"
                raise InputError(f"{found}, expected at least {SMALLEST:g} m")
        if self.loops < 1:
            raise InputError(f"loops: found {self.loops!r}, expected at least 1")
        way = 2 * (self.width + self.height)
        if not self.loops * max(4 * SIDE, way / self.speed * RATE) <= MOST_ROWS:
            raise InputError(
                f"loops: found {self.loops!r} of {way / self.speed:g} s, expected at most "
                f"{MOST_ROWS:g} rows"
            )

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Where the sides meet, in the order of the run, (4 loops + 1, 2) in m."""
        x, y = self.width / 2, self.height / 2
        loop = [(-x, -y), (x, -y), (x, y), (-x, y)]
        return np.array([*(loop * self.loops), loop[0]])

    @property
    def sides(self) -> list[Motion]:
        """The 4 loops straight moves."""
        ends = self.vertices
        return [line(start, end, self.speed, self.acceleration) for start, end in pairwise(ends)]

    @property
    def motion(self) -> Motion:
        """The whole run with its rest at the end."""
        return chain(*self.sides, rest(self.vertices[-1], REST))

    @property
    def vertex_times(self) -> NDArray[np.float64]:
        """When the command passes each vertex, (4 loops + 1,) in s."""
        return np.concatenate([[0.0], np.cumsum([side.duration for side in self.sides])])
