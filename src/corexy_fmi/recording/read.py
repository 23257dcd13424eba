"""Reading a recording from CSV (metadata lines, header, numbers)."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.recording.inputs import parse_controller
from corexy_fmi.recording.record import ANGLES, INPUTS, UNITS, VOLTAGES, Recording
from corexy_fmi.recording.table import read_table

CLOCKS = ("free", "exact")
LONGEST_GAP = 600.0  # [s]: two logs in one file; a model would run through it


def read_recording(path: str | Path, *, needs_inputs: bool = True) -> Recording:
    """The recording in a CSV file; blank cells are NaN, unknown columns are kept.

    Raises InputError, naming line and column, for a file that cannot be read, a first column other
    than time, a repeated column, a cell that is no finite number, a row of another length, time
    that does not increase or has a gap of minutes and, with ``needs_inputs``, absent or initially
    blank inputs.
    """
    path = Path(path)
    try:
        with path.open("rb") as stream:
            metadata, names, line = _head(stream, path)
            table = read_table(stream, path, names, line + 1)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: {reason}, expected a recording (CSV)") from error
    check_time(table[:, 0], path, line + 1)
    _check_gaps(table[:, 0], path, line + 1)
    channels = {name: table[:, i].copy() for i, name in enumerate(names) if i}
    recording = Recording(path.name, table[:, 0].copy(), channels, metadata)
    _check_metadata(recording, path)
    _check_inputs(recording, path, line + 1, needs_inputs)
    return recording


def _head(stream: BinaryIO, path: Path) -> tuple[dict[str, str], list[str], int]:
    """Metadata, column names and the header's line number."""
    metadata: dict[str, str] = {}
    for number, raw in enumerate(stream, start=1):
        text = _decoded(raw, path, number)
        if not text.startswith("#"):
            return metadata, _names(text, path, number), number
        key, colon, value = text.lstrip("#").partition(":")
        if colon and key.strip() in metadata:
            raise InputError(
                f"{path}, line {number}: metadata {key.strip()!r} twice, expected once"
            )
        if colon:
            metadata[key.strip()] = value.strip()
    raise InputError(f"{path}: no header line, expected one that begins with time")


def _decoded(raw: bytes, path: Path, number: int) -> str:
    """One line as text, without its end and a byte-order mark."""
    try:
        return raw.decode("utf-8-sig" if number == 1 else "utf-8").strip()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}, line {number}: not UTF-8 text, expected a CSV file") from error


def _names(header: str, path: Path, line: int) -> list[str]:
    """Column names, checked."""
    names = [name.strip().strip('"').strip() for name in header.split(",")]
    where = f"{path}, line {line}"
    if names[0] != "time":
        raise InputError(
            f"{where}, column 1: found {names[0][:40]!r}, expected a header whose first column is "
            "'time', separated by commas"
        )
    for column, name in enumerate(names, start=1):
        if not name:
            raise InputError(f"{where}, column {column}: blank name, expected a column name")
        if name in names[: column - 1]:
            raise InputError(f"{where}, column {column}: {name!r} appears twice, expected once")
    return names


def check_time(
    time: NDArray[np.float64], path: Path, first: int, place: str = "line", column: str = "time"
) -> None:
    """Refuse a time [s] that is not complete and strictly increasing, or of fewer than two rows.

    ``first`` is the number of the first row, of whatever kind of ``place``.
    """
    if len(time) < 2:
        raise InputError(
            f"{path}, {place} {first + len(time)}: {len(time)} rows of numbers, expected at least 2"
        )
    if np.isnan(time).any():
        row = first + int(np.flatnonzero(np.isnan(time))[0])
        raise InputError(f"{path}, {place} {row}, column {column}: blank, expected a time in s")
    steps = np.flatnonzero(np.diff(time) <= 0)
    if len(steps):
        row = int(steps[0]) + 1
        raise InputError(
            f"{path}, {place} {first + row}, column {column}: {float(time[row])!r} "
            f"after {float(time[row - 1])!r}, expected strictly increasing time"
        )


def _check_gaps(time: NDArray[np.float64], path: Path, first_line: int) -> None:
    """One run, without a gap of minutes."""
    gaps = np.flatnonzero(np.diff(time) > LONGEST_GAP)
    if len(gaps):
        row = int(gaps[0]) + 1
        raise InputError(
            f"{path}, line {first_line + row}, column time: {float(time[row])!r} "
            f"after {float(time[row - 1])!r}, expected one run without a gap of more than "
            f"{LONGEST_GAP:g} s"
        )


def _check_metadata(recording: Recording, path: Path) -> None:
    """Metadata that the engine acts on must be understood."""
    clock = recording.metadata.get("clock", "exact")
    if clock not in CLOCKS:
        raise InputError(f"{path}, metadata clock: found {clock!r}, expected 'free' or 'exact'")
    if "controller" in recording.metadata:
        parse_controller(recording.metadata["controller"], str(path))


def _motors(recording: Recording, path: Path) -> str:
    """How many motors the metadata name."""
    motors = recording.metadata.get("motors", "2")
    if motors not in ("1", "2"):
        raise InputError(f"{path}, metadata motors: found {motors!r}, expected 1 or 2")
    return motors


def _check_inputs(recording: Recording, path: Path, line: int, needs_inputs: bool) -> None:
    """Both inputs of a pair are there, and sampled in the first row."""
    motors = int(_motors(recording, path))
    pairs = ANGLES[:motors], VOLTAGES[:motors]
    if needs_inputs and not any(_pair(recording, pair) for pair in pairs):
        raise InputError(f"{path}, line {line - 1}: {_missing(list(recording.channels))}")
    for name in INPUTS:
        if name in recording and np.isnan(recording[name][0]):
            raise InputError(
                f"{path}, line {line}, column {name}: blank, "
                "expected an input value in the first row"
            )


def _pair(recording: Recording, pair: Sequence[str]) -> bool:
    return all(name in recording for name in pair)


def _missing(names: list[str]) -> str:
    """What to say about a header without inputs."""
    half = [name for name in INPUTS if name in names]
    strange = [name for name in names if name not in UNITS]
    near = [(name, difflib.get_close_matches(name, INPUTS, 1, 0.6)) for name in strange]
    found = f"only {half[0]!r}" if half else "no input columns"
    hint = "".join(f" ({name!r} is near {match[0]!r})" for name, match in near[:1] if match)
    return f"{found}{hint}, expected phi1 and phi2 [rad] or V1 and V2 [V]"
