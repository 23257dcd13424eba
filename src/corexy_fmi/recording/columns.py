"""A recording out of any table: MATLAB .mat or CSV, by a map of its columns with their units."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.nearest import nearest
from corexy_fmi.recording.read import check_time
from corexy_fmi.recording.record import UNITS, Recording
from corexy_fmi.recording.table import read_table

Array = NDArray[np.float64]
GRAVITY = 9.80665
FACTORS = {
    "s": ("s", 1.0), "ms": ("s", 1e-3), "us": ("s", 1e-6),
    "m": ("m", 1.0), "mm": ("m", 1e-3), "um": ("m", 1e-6),
    "m/s": ("m/s", 1.0), "mm/s": ("m/s", 1e-3),
    "m/s^2": ("m/s^2", 1.0), "mm/s^2": ("m/s^2", 1e-3), "g": ("m/s^2", GRAVITY),
    "rad": ("rad", 1.0), "deg": ("rad", np.pi / 180), "degrees": ("rad", np.pi / 180),
    "rev": ("rad", 2 * np.pi), "steps": ("rad", 2 * np.pi / 200),
    "V": ("V", 1.0), "mV": ("V", 1e-3), "A": ("A", 1.0), "mA": ("A", 1e-3),
}  # fmt: skip
STEPS = re.compile(r"steps(?P<turn>\d+)?(?:/(?P<micro>\d+))?")  # steps400/16
ENTRY = re.compile(r"\s*(?P<ours>\w+)\s*=\s*(?P<theirs>[^\[\]]+?)\s*(?:\[(?P<unit>[^\]]+)\])?\s*")
BOM = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class _Table:
    """Columns by name, why some of them are none, and where the first row stands."""

    columns: Mapping[str, Array]
    refused: Mapping[str, str]
    first: int
    place: str


def import_columns(
    path: Path, entries: Sequence[str], metadata: Mapping[str, str], radius: float
) -> Recording:
    """The recording of a table's columns.

    Each entry is ``ours=theirs`` or ``ours=theirs[unit]``; ``time`` must be among ours.  Without
    any, columns that have our names are taken as they are.  A length as an angle is travel over
    ``radius`` [m]; steps are 200 to a turn, ``steps400/16`` 16 microsteps of 400.
    Raises InputError for an entry, column or unit that is unknown, a matrix, a column that stands
    twice, columns that differ in length, and a time that does not increase, naming its line.
    """
    table = _mat(path) if path.suffix.lower() == ".mat" else _csv(path)
    entries = entries or [f"{name}={name}" for name in table.columns if name in UNITS]
    mapped = [_mapped(entry, table, path, radius) for entry in entries]
    for name, count in Counter(name for name, _ in mapped).items():
        if count > 1:
            raise InputError(f"map: {name} {count} times, expected once")
    channels = dict(mapped)
    lengths = {name: len(values) for name, values in channels.items()}
    if "time" not in channels:
        raise InputError(f"{path}: no column mapped to time, expected one such as time=t[s]")
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise InputError(f"{path}: columns of different lengths ({told}), expected one length")
    time = channels.pop("time")
    check_time(time, path, table.first, table.place)
    return Recording(path.name, time, channels, dict(metadata))


def _mapped(entry: str, table: _Table, path: Path, radius: float) -> tuple[str, Array]:
    """One channel in SI units."""
    found = ENTRY.fullmatch(entry)
    if found is None:
        raise InputError(f"map: found {entry!r}, expected OURS=THEIRS or OURS=THEIRS[unit]")
    ours, theirs, unit = found["ours"], found["theirs"], found["unit"]
    if ours not in UNITS:
        raise InputError(f"map: unknown channel {ours!r}, expected {_either(UNITS, ours)}")
    if theirs not in table.columns:
        raise InputError(f"{path}: no column {theirs!r}, expected {_either(table.columns, theirs)}")
    if theirs in table.refused:
        raise InputError(f"{path}: column {theirs!r} {table.refused[theirs]}")
    return ours, table.columns[theirs] * _factor(UNITS[ours], unit or UNITS[ours], entry, radius)


def _either(known: Mapping[str, object], name: str) -> str:
    return f"one of {', '.join(known)}{nearest(name, tuple(known))}"


def _factor(wanted: str, unit: str, entry: str, radius: float) -> float:
    """What to multiply by; raises InputError where the unit does not fit."""
    base, factor = FACTORS.get(unit) or _steps(unit)
    if (base, wanted) == ("m", "rad"):
        return factor / radius
    if base != wanted:
        fits = [n for n, (b, _) in FACTORS.items() if b in (wanted, "m" if wanted == "rad" else "")]
        raise InputError(f"map: {entry!r}: unit {unit!r}, expected one of {', '.join(fits)}")
    return factor


def _steps(unit: str) -> tuple[str, float]:
    """Unit and factor of steps such as ``steps400/16``; nothing for another text."""
    found = STEPS.fullmatch(unit)
    turn = int(found["turn"] or 200) * int(found["micro"] or 1) if found else 0
    return ("rad", 2 * np.pi / turn) if turn else ("", 0.0)


def _csv(path: Path) -> _Table:
    """Columns of a CSV file with a header; lines that start with # are skipped before it."""
    try:
        with path.open("rb") as file:
            line = 1
            while (raw := file.readline().removeprefix(BOM if line == 1 else b"")).startswith(b"#"):
                line += 1
            head = raw.decode("utf-8").strip()
            if not head:
                raise InputError(f"{path}: no header line, expected one that names the columns")
            names = [name.strip().strip(chr(34)) for name in head.split(",")]
            table = read_table(file, path, names, line + 1)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}, expected a CSV file") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text, expected a CSV file") from error
    twice = {
        name: f"stands {count} times in the header, expected once"
        for name, count in Counter(names).items()
        if count > 1
    }
    return _Table(dict(zip(names, table.T, strict=True)), twice, line + 1, "line")


def _mat(path: Path) -> _Table:
    """Numeric vectors of a MATLAB file (to version 7)."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        found = loadmat(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}, expected a MATLAB file") from error
    except (ValueError, NotImplementedError, TypeError, MatReadError) as error:
        raise InputError(f"{path}: {error}, expected a MATLAB file up to version 7") from error
    arrays = {
        name: np.asarray(value, float)
        for name, value in found.items()
        if not name.startswith("__") and getattr(value, "dtype", np.dtype("O")).kind in "iuf"
    }
    matrices = {
        name: f"is a matrix of {' x '.join(map(str, value.shape))}, expected a vector"
        for name, value in arrays.items()
        if sum(length > 1 for length in value.shape) > 1
    }
    return _Table({name: value.ravel() for name, value in arrays.items()}, matrices, 1, "row")
