"""One recording out of two logs: commands by one clock, measurements by another, or by the same."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.recording.align import Clocks, Signal, clocks
from corexy_fmi.recording.inputs import inputs
from corexy_fmi.recording.record import ANGLES, INPUTS, Recording

Array = NDArray[np.float64]
ORDER = (("ax", "ay"), ("vx", "vy"), ("x", "y"), ("phi1_meas", "phi2_meas"))
DERIVATIVES = {"ax": 2, "vx": 1, "x": 1, "phi1_meas": 1}


def merge(
    commands: Recording,
    measured: Recording,
    rest: tuple[tuple[float, float], tuple[float, float]],
    about: Mapping[str, str],
    *,
    align: bool,
) -> Recording:
    """Inputs of ``commands`` and channels of ``measured`` over the rows of both, blanks between.

    ``rest`` is x and y [m] over the motors' angles [rad], eq. (1).  With ``align`` the second clock
    is put on the first: offset and drift stand in the metadata with their standard errors, and the
    clock is declared free.  Raises InputError where the logs do not resemble each other.
    """
    _check(commands, measured)
    told, time = dict(about), measured.time
    if align:
        found = _aligned(commands, measured, rest)
        time = found.on_first(time)
        told |= {"clock": "free", "aligned": found.line}
    begin = min(float(time[0]), float(commands.time[0]))
    rows = np.unique(np.concatenate([commands.time, time]))
    channels = {n: _placed(rows, commands.time, commands[n]) for n in INPUTS if n in commands}
    for name, values in channels.items():
        values[0] = commands[name][0]  # at rest before the first command
    channels |= {n: _placed(rows, time, measured[n]) for n in measured.channels if n not in INPUTS}
    names = f"{commands.name} and {measured.name}"
    return Recording(names, rows - begin, channels, {"source": names} | told)


def _check(commands: Recording, measured: Recording) -> None:
    if not any(name in commands for name in INPUTS):
        raise InputError(f"{commands.name}: no column mapped to phi1, phi2, V1 or V2, expected one")
    if not measured.measured:
        raise InputError(f"{measured.name}: no column mapped to a measured channel such as x, ax")


def _placed(rows: Array, time: Array, values: Array) -> Array:
    """Values at their own rows, NaN elsewhere."""
    placed = np.full(len(rows), np.nan)
    placed[np.searchsorted(rows, time)] = values
    return placed


def _aligned(
    commands: Recording, measured: Recording, rest: tuple[tuple[float, float], tuple[float, float]]
) -> Clocks:
    """The measurements' clock against that of the commands."""
    if ANGLES[0] not in commands:
        raise InputError(f"{commands.name}: no column mapped to phi1, expected it for --align")
    pair = next((p for p in ORDER if set(p) & set(measured.measured)), None)
    if pair is None:
        told = ", ".join(measured.measured)
        raise InputError(f"{measured.name}: {told} cannot be aligned, expected x, y or ax, ay")
    names = [name for name in pair if name in measured.measured]
    seen = np.all([np.isfinite(measured[n]) for n in names], axis=0)
    values = np.column_stack([measured[n][seen] for n in names])
    moved = np.column_stack([_course(commands, name, rest) for name in names])
    first = _moving(commands.time, moved, DERIVATIVES[pair[0]])
    order = DERIVATIVES[pair[0]] if pair[0] in ("x", "phi1_meas") else 0
    second = _moving(measured.time[seen], values - np.median(values, axis=0), order)
    return clocks(first, second, f"{commands.name} and {measured.name}")


def _course(
    commands: Recording, name: str, rest: tuple[tuple[float, float], tuple[float, float]]
) -> Array:
    """Where the commands lead a channel, in m or rad."""
    given = inputs(commands)
    phi1 = given["phi1"]
    phi2 = given.get("phi2", np.zeros_like(phi1))
    if name.endswith("_meas"):
        return phi1 if name.startswith("phi1") else phi2
    one, other = rest["xy".index(name[-1])]
    return np.asarray(one * phi1 + other * phi2)


def _moving(time: Array, values: Array, order: int) -> Signal:
    """A signal of the so many times derived values."""
    for _ in range(order):
        values = np.gradient(values, time, axis=0)
    return Signal(time, values)
