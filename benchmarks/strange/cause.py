"""A cause by the names and parameters of the catalogue, whose size is found later."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from benchmarks.shop.case import HOLDOUT, TRAIN
from benchmarks.shop.motions import Motion
from benchmarks.shop.stage import Array
from benchmarks.strange.machines import Machine, Random
from benchmarks.strange.running import HEALTHY, Acts

FILES = TRAIN + HOLDOUT
Parameters = Mapping[str, float]


class About(NamedTuple):
    """What a cause is drawn for."""

    machine: Machine
    motions: list[Motion]


@dataclass(frozen=True)
class Cause:
    """``parameters`` and ``acts`` follow from a size within ``bounds``; ``whole``: an integer;
    ``without``: what stays without it.
    """

    name: str
    location: str
    bounds: tuple[float, float]
    parameters: Callable[[float], Parameters]
    acts: Callable[[float], Acts]
    whole: bool = False
    without: Acts = HEALTHY


Draws = Callable[[Random, About], Cause]


def axis_of(random: Random) -> tuple[int, str]:
    """x or y."""
    axis = int(random.integers(2))
    return axis, "xy"[axis]


def sign_of(random: Random) -> float:
    """1 or -1."""
    return float(random.choice([-1.0, 1.0]))


def pair(axis: int, value: float, other: float) -> tuple[float, float]:
    """A value for one axis, or motor, another for the other."""
    return (value, other) if axis == 0 else (other, value)


def columns(axis: int, values: Array, other: float) -> Array:
    """Values over time for one axis, or motor, a constant for the other: (n, 2)."""
    both = np.full((len(values), 2), other)
    both[:, axis] = values
    return both


def law(axis: int, values: Array) -> Array:
    """Values over position for one axis, none for the other: (2, n)."""
    return np.ascontiguousarray(columns(axis, values, 0.0).T)
