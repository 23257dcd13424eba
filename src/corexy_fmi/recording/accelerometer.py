"""What a toolhead's accelerometer felt, joined with the motion that was commanded meanwhile."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.motion import SAME_INSTANT, Motion
from corexy_fmi.recording.record import Recording
from corexy_fmi.recording.table import read_table

Array = NDArray[np.float64]
COLUMNS = ("time", "accel_x", "accel_y", "accel_z")
MILLIMETRE = 1e-3  # [m]
ENOUGH_AT_REST = 100  # samples from which the mean at rest is taken
AXIS = re.compile(r"\s*([+-]?)([xyz])\s*")


def read_samples(path: Path) -> tuple[Array, Array]:
    """Stamps (n,) in s and accelerations (n, 3) in m/s^2 of a raw file of Klipper.

    Raises InputError where it is none.
    """
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
    names = tuple(name.strip() for name in text.lstrip("#").split(","))
    if names[0] == "freq":
        raise InputError(
            f"{path}, line {number}: a spectrum, expected samples over time; "
            "TEST_RESONANCES writes them with OUTPUT=raw_data"
        )
    if names != COLUMNS:
        raise InputError(
            f"{path}, line {number}: found {text[:40]!r}, expected '#{','.join(COLUMNS)}'"
        )
    return number


def along_stage(felt: Array, axes: str) -> Array:
    """Accelerations along the stage's x and y (n, 2) of a sensor's (n, 3).

    ``axes`` says which sensor axes they are, such as ``-z,+y``.
    """
    matches = [AXIS.fullmatch(part) for part in axes.split(",")]
    parts = [(match[1], match[2]) for match in matches if match]
    if len(matches) != 2 or len(parts) != 2 or parts[0][1] == parts[1][1]:
        raise InputError(
            f"axes: found {axes!r}, expected two different sensor axes such as '-z,+y'"
        )
    return np.column_stack(
        [(-1 if sign == "-" else 1) * felt[:, "xyz".index(axis)] for sign, axis in parts]
    )


def at_rest(measured: Array, calm: NDArray[np.bool_]) -> Array:
    """What the sensor shows at rest (2,): mean of the calm samples, else the median of all."""
    if np.count_nonzero(calm) >= ENOUGH_AT_REST:
        return measured[calm].mean(axis=0)
    return np.median(measured, axis=0)


def commanded(
    name: str,
    since: Array,
    measured: Array,
    motion: Motion,
    pulley_radius: float,
    about: Mapping[str, str],
) -> Recording:
    """The recording of a motion: phi1, phi2 [rad], and ax, ay [m/s^2] at times ``since`` (n,) [s].

    Rows at changes of acceleration are blank in ax, ay.
    """
    time, rows = _rows(since, motion)
    x, y = motion.position(time).T
    channels = {"phi1": (x + y) / pulley_radius, "phi2": (x - y) / pulley_radius}
    for axis, values in zip(("ax", "ay"), measured.T, strict=True):
        channels[axis] = np.full(len(time), np.nan)
        channels[axis][rows] = values
    return Recording(name, time, channels, dict(about))


def _rows(samples: Array, motion: Motion) -> tuple[Array, NDArray[np.intp]]:
    """Times of all rows (n,), and which of them are the samples."""
    marks = np.array([0.0, *(t for t in motion.instants if t < samples[-1])])
    near = np.clip(np.searchsorted(samples, marks), 1, len(samples) - 1)
    gap = np.minimum(np.abs(samples[near] - marks), np.abs(samples[near - 1] - marks))
    time = np.unique(np.concatenate([samples, marks[gap > SAME_INSTANT]]))
    return time, np.searchsorted(time, samples)
