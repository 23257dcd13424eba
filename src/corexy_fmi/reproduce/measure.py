"""What is measured of a parameter set, many sets at a time in the kernel's lanes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce import paths
from corexy_fmi.reproduce.paper import SPEEDS
from corexy_fmi.reproduce.sets import (
    GROUPS,
    Parameters,
    at_radius,
    scaled,
    vectors,
    without_coulomb,
)

Array = NDArray[np.float64]
RADIUS = 5e-3  # [m] on which all sets are run, see `at_radius`
MIDDLE = 0.039  # [m/s] of Fig. 5
FACTORS = (0.5, 1.0, 2.0)
INTERVALS = (0.016, 0.032, 0.064, 0.128, 0.256, 0.512)  # [s] between pulses
WATCHED = 1.0  # [s] after one pulse
SETTLED = 0.05  # of a full step
BLOCK = 64  # sets between reports of progress
MODELS = {"full": "full", "4-DoF": "reduced"}


@dataclass(frozen=True, eq=False)
class Measures:
    """One row for each set; lengths in m, times in s.

    ``error[model, turn]`` (sets, speeds), ``waviness`` and ``overshoot[turn]`` (sets, speeds) of
    the full model, ``exponent[group, turn]`` (sets,), ``settling[axis]`` (sets,) without Coulomb
    friction (infinite beyond `WATCHED`), ``pulsed[friction, turn]`` (sets, intervals) in full
    steps, with friction "with" or "without" Coulomb.
    """

    error: dict[tuple[str, str], Array]
    waviness: dict[str, Array]
    overshoot: dict[str, Array]
    exponent: dict[tuple[str, str], Array]
    settling: dict[str, Array]
    pulsed: dict[tuple[str, str], Array]


def measure(
    sets: Sequence[Parameters], report: Callable[[float], None] = lambda share: None
) -> Measures:
    """Measure every set; ``report`` is told the share that is done."""
    alike, parts = [at_radius(p, RADIUS) for p in sets], []
    for first in range(0, len(alike), BLOCK):
        parts.append(_measure(alike[first : first + BLOCK]))
        report(min(first + BLOCK, len(alike)) / len(alike))
    joined = {}
    for name in Measures.__dataclass_fields__:
        tables = [getattr(part, name) for part in parts]
        joined[name] = {key: np.concatenate([t[key] for t in tables]) for key in tables[0]}
    return Measures(**joined)


def _measure(sets: Sequence[Parameters]) -> Measures:
    """One block."""
    values, smooth = vectors(sets), vectors([without_coulomb(p) for p in sets])
    error, waviness, overshoot = {}, {}, {}
    for turn in TURNS:
        corners = [paths.at_speed(turn, speed, RADIUS)[0] for speed in SPEEDS]
        for name, fidelity in MODELS.items():
            runs = [_paths(c.excitation, values, fidelity) for c in corners]
            error[name, turn] = _each(paths.Corner.error, corners, runs)
            if name == "full":
                waviness[turn] = _each(paths.Corner.waviness, corners, runs)
                overshoot[turn] = _each(paths.Corner.overshoot, corners, runs)
    return Measures(
        error=error,
        waviness=waviness,
        overshoot=overshoot,
        exponent={(g, turn): _exponents(sets, g, turn) for g in GROUPS for turn in TURNS},
        settling={axis: _settling(smooth, axis) for axis in "xy"},
        pulsed={
            (name, turn): _pulsed(rows, turn)
            for name, rows in (("with", values), ("without", smooth))
            for turn in TURNS
        },
    )


def _paths(drive: Excitation, values: Array, fidelity: str = "full") -> Array:
    """x, y [m] of every set, (sets, rows, 2)."""
    return run_lanes(bundled_layout(), drive, values, fidelity=fidelity).transpose(0, 2, 1)


def _each(
    what: Callable[[paths.Corner, Array], float],
    corners: Sequence[paths.Corner],
    runs: Sequence[Array],
) -> Array:
    """A number of every set in every run, (sets, runs)."""
    pairs = zip(corners, runs, strict=True)
    return np.array([[what(corner, path) for path in run] for corner, run in pairs]).T


def _exponents(sets: Sequence[Parameters], group: str, turn: str) -> Array:
    """Log-slope of the error over a group's factor, (sets,); NaN where an error is not positive."""
    corner, _ = paths.at_speed(turn, MIDDLE, RADIUS)
    runs = [
        _paths(corner.excitation, vectors([scaled(p, group, f) for p in sets])) for f in FACTORS
    ]
    return exponents(FACTORS, _each(paths.Corner.error, [corner] * len(FACTORS), runs))


def exponents(factors: Sequence[float], errors: Array) -> Array:
    """Slope of log error (sets, factors) over log factor, (sets,)."""
    logs = np.log(np.where(errors > 0, errors, np.nan))
    x = np.log(factors) - np.mean(np.log(factors))
    return np.asarray(logs @ x / (x @ x))


def _settling(values: Array, axis: str) -> Array:
    """Time [s] from which an axis stays within `SETTLED` of a full step of its end, (sets,)."""
    drive = paths.one_pulse(axis, RADIUS, WATCHED)
    travel = _paths(drive, values)[:, :, "xy".index(axis)]
    step = paths.full_step(RADIUS)
    outside = np.abs(travel - step) > SETTLED * step
    last = outside.shape[1] - 1 - np.argmax(outside[:, ::-1], axis=1)
    times = np.append(drive.time[1:], np.inf)
    return times[last]


def _pulsed(values: Array, turn: str) -> Array:
    """Contour error of a corner in pulses, in full steps, (sets, intervals)."""
    corners = [paths.by_pulses(turn, interval, RADIUS) for interval in INTERVALS]
    runs = [_paths(corner.excitation, values) for corner in corners]
    return _each(paths.Corner.error, corners, runs) / paths.full_step(RADIUS)
