"""Import of Klipper's accelerometer files: what a toolhead sensor felt during one known move.

The file holds ``#time,accel_x,accel_y,accel_z`` in s and mm/s^2 along the sensor's own axes, with
gravity in them.  The commanded angles are not in it: they follow from the move by eq. (1).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.motion import SAME_INSTANT, Motion, chain, line, rest
from corexy_fmi.recording.record import Recording
from corexy_fmi.recording.table import read_table

Array = NDArray[np.float64]
COLUMNS = ("time", "accel_x", "accel_y", "accel_z")
MILLIMETRE = 1e-3  # [m]
ENOUGH_AT_REST = 100  # samples from which the mean at rest is taken
AXIS = re.compile(r"\s*([+-]?)([xyz])\s*")


@dataclass(frozen=True)
class Move:
    """One straight trapezoid move from rest to rest, in coordinates of the stage's centre.

    ``start``, ``end`` [m], ``speed`` [m/s], ``acceleration`` [m/s^2]; ``offset`` [s] is the time of
    its start after the first sample, None where nobody knows it (the clock is then left free).
    """

    start: tuple[float, float]
    end: tuple[float, float]
    speed: float
    acceleration: float
    offset: float | None = None


def import_klipper(path: str | Path, move: Move, axes: str, pulley_radius: float) -> Recording:
    """The recording of one move: phi1, phi2 [rad] commanded, ax, ay [m/s^2] without gravity.

    ``axes`` says which sensor axes are the stage's x and y, such as ``-z,+y``.  Time begins with
    the first sample or the move, whichever is earlier; rows at changes of acceleration are blank in
    ax, ay.  Raises InputError where the file or ``axes`` cannot be understood.
    """
    path = Path(path)
    stamps, felt = _read(path)
    measured = _mapped(felt, axes)
    lead = max(move.offset or 0.0, 0.0)
    since = stamps - stamps[0] + max(-(move.offset or 0.0), 0.0)
    straight = line(move.start, move.end, move.speed, move.acceleration)
    motion = chain(rest(move.start, lead), straight, rest(move.end, max(since[-1], 0.0)))
    measured -= _at_rest(since, measured, lead + straight.duration)
    time, rows = _rows(since, motion)
    channels = _angles(motion, time, pulley_radius)
    for axis, values in zip(("ax", "ay"), measured.T, strict=True):
        channels[axis] = np.full(len(time), np.nan)
        channels[axis][rows] = values
    return Recording(path.name, time, channels, _metadata(path, move, axes))


def _read(path: Path) -> tuple[Array, Array]:
    """Stamps (n,) in s and accelerations (n, 3) in m/s^2, as in the file."""
    try:
        with path.open("rb") as stream:
            line_number = _skip_header(stream, path)
            table = read_table(stream, path, COLUMNS, line_number + 1)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: {reason}, expected a Klipper accelerometer file") from error
    if len(table) < 2 or np.isnan(table).any():
        raise InputError(f"{path}: {len(table)} rows or blank cells, expected complete samples")
    late = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if len(late):
        row = line_number + 2 + int(late[0])
        raise InputError(f"{path}, line {row}, column time: expected strictly increasing time")
    return table[:, 0], table[:, 1:] * MILLIMETRE


def _skip_header(stream: BinaryIO, path: Path) -> int:
    """Number of the header's line; lines of ## before it are passed over."""
    text, number = "##", 0
    while text.startswith("##"):
        text, number = stream.readline().decode("utf-8", errors="replace").strip(), number + 1
    if tuple(name.strip() for name in text.lstrip("#").split(",")) != COLUMNS:
        raise InputError(
            f"{path}, line {number}: found {text[:40]!r}, expected '#{','.join(COLUMNS)}'"
        )
    return number


def _mapped(felt: Array, axes: str) -> Array:
    """Accelerations along the stage's x and y, (n, 2)."""
    matches = [AXIS.fullmatch(part) for part in axes.split(",")]
    parts = [(match[1], match[2]) for match in matches if match]
    if len(matches) != 2 or len(parts) != 2 or parts[0][1] == parts[1][1]:
        raise InputError(
            f"axes: found {axes!r}, expected two different sensor axes such as '-z,+y'"
        )
    return np.column_stack(
        [(-1 if sign == "-" else 1) * felt[:, "xyz".index(axis)] for sign, axis in parts]
    )


def _at_rest(time: Array, measured: Array, end: float) -> Array:
    """What the sensor shows at rest (2,): mean of the last half after the move, else the median."""
    calm = time > (end + time[-1]) / 2
    if end < time[-1] and np.count_nonzero(calm) >= ENOUGH_AT_REST:
        return measured[calm].mean(axis=0)
    return np.median(measured, axis=0)


def _rows(samples: Array, motion: Motion) -> tuple[Array, NDArray[np.intp]]:
    """Times of all rows (n,), and which of them are the samples."""
    marks = np.array([0.0, *(t for t in motion.instants if t < samples[-1])])
    apart = np.abs(samples - marks[:, None]).min(axis=1) > SAME_INSTANT
    time = np.unique(np.concatenate([samples, marks[apart]]))
    return time, np.searchsorted(time, samples)


def _angles(motion: Motion, time: Array, pulley_radius: float) -> dict[str, Array]:
    """Commanded motor angles [rad], eq. (1)."""
    x, y = motion.position(time).T
    return {"phi1": (x + y) / pulley_radius, "phi2": (x - y) / pulley_radius}


def _metadata(path: Path, move: Move, axes: str) -> dict[str, str]:
    """Where the recording comes from."""
    about = {
        "source": f"klipper {path.name}",
        "move": f"{move.start} to {move.end} m, {move.speed} m/s, {move.acceleration} m/s^2",
        "axes": axes,
    }
    return about | ({"clock": "free"} if move.offset is None else {})
