"""Import of Klipper's motion-analysis captures (scripts/motan/data_logger.py).

NAME.json.gz holds JSON messages, each ended by the byte 3.  Those of ``trapq:toolhead`` are moves
(time, duration, start speed, acceleration, start position, direction; s, mm), those of
``adxl345:NAME`` (or another sensor's) samples (time, x, y, z; s, mm/s^2), both in print time: one
clock.  Input shaping is no part of the moves.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.motion import Motion
from corexy_fmi.recording.accelerometer import MILLIMETRE, along_stage, at_rest, commanded
from corexy_fmi.recording.record import Recording

Array = NDArray[np.float64]
SENSORS = ("adxl345", "lis2dw", "lis3dh", "mpu9250", "icm20948", "bmi160")
LEAD = 0.5  # [s] of rest before the first move that is kept
SETTLED = 0.5  # [s] after a move from which on the sensor is at rest


@dataclass(frozen=True, eq=False)
class Capture:
    """``moves`` (n, 8): time, duration, start speed, acceleration, x, y, direction x, y;
    ``samples`` (m, 4): time and three axes; in s, m, m/s and m/s^2.  ``shaper`` tells whether input
    shaping is configured.
    """

    moves: Array
    samples: Array
    sensor: str
    shaper: bool


def read_capture(path: Path, sensor: str = "") -> Capture:
    """The capture in a file; ``sensor`` is the accelerometer's name where there are several.

    Raises InputError for what is no capture, or one without moves or samples.
    """
    moves: list[list[float]] = []
    felt: dict[str, list[list[float]]] = {}
    shaper = False
    for number, message in enumerate(_messages(path), 1):
        kind, _, name = str(message.get("q", "")).partition(":")
        try:
            if (kind, name) == ("trapq", "toolhead"):
                moves += [_move(entry) for entry in message["params"]["data"]]
            elif kind in SENSORS:
                rows = message["params"]["data"]
                felt.setdefault(name, []).extend([_sample(row) for row in rows])
        except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise InputError(
                f"{path}, message {number}: no data of {kind} {name}, expected a capture of "
                "Klipper's data_logger.py"
            ) from error
        shaper = shaper or _shaped(message)
    if not moves:
        raise InputError(f"{path}: no moves of the toolhead, expected messages trapq:toolhead")
    name = _chosen(felt, sensor, path)
    samples = np.array(felt[name])
    samples = samples[np.concatenate([[True], np.diff(samples[:, 0]) > 0])]
    samples[:, 1:] *= MILLIMETRE
    return Capture(_ordered(moves), samples, name, shaper)


def import_motan(
    path: Path,
    axes: str,
    centre: Sequence[float],
    pulley_radius: float,
    sensor: str = "",
    span: tuple[float, float] | None = None,
) -> Recording:
    """The recording of a capture, or of a span of it [s] after its first sample.

    ``centre`` [m] is the stage's in the printer's coordinates, ``axes`` as of `import_klipper`.
    It begins at rest, `LEAD` before the first move.  Raises InputError as `read_capture`, and where
    samples and moves do not overlap.
    """
    capture = read_capture(path, sensor)
    begin, end = _bounds(capture, span, path)
    inside = (capture.samples[:, 0] >= begin) & (capture.samples[:, 0] <= end)
    if np.count_nonzero(inside) < 20:
        raise InputError(f"{path}: {np.count_nonzero(inside)} samples there, expected at least 20")
    since = capture.samples[inside, 0] - begin
    motion = _motion(capture.moves, begin, end, centre)
    measured = along_stage(capture.samples[inside, 1:], axes)
    measured -= at_rest(measured, _calm(capture.moves, since + begin))
    about = {
        "source": f"klipper motan {path.name}, {capture.sensor}",
        "begin": f"{begin:.6f} s of print time",
        "axes": axes,
    }
    about |= {"shaper": "configured, no part of the commands here"} if capture.shaper else {}
    return commanded(path.name, since, measured, motion, pulley_radius, about)


def _messages(path: Path) -> Iterator[dict[str, Any]]:
    """Messages of a file, packed or not; one that was cut off ends it."""
    try:
        raw = path.read_bytes()
        text = zlib.decompressobj(31).decompress(raw) if raw[:2] == b"\x1f\x8b" else raw
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: {reason}, expected a capture (.json.gz)") from error
    except zlib.error as error:
        raise InputError(f"{path}: damaged, expected a capture (.json.gz)") from error
    parts = text.split(b"\x03")
    for number, part in enumerate(parts[:-1] if b"\x03" in text else parts, 1):
        try:
            message = json.loads(part)
        except ValueError as error:
            raise InputError(
                f"{path}, message {number}: not JSON, expected a capture of Klipper's "
                "data_logger.py (NAME.json.gz)"
            ) from error
        if isinstance(message, dict):
            yield message


def _move(entry: Sequence[Any]) -> list[float]:
    time, duration, speed, acceleration, place, way = entry[:6]
    mm = MILLIMETRE
    return _finite([time, duration, mm * speed, mm * acceleration,
                    mm * place[0], mm * place[1], way[0], way[1]])  # fmt: skip


def _sample(row: Sequence[Any]) -> list[float]:
    time, x, y, z = row[:4]
    return _finite([time, x, y, z])


def _finite(values: Sequence[Any]) -> list[float]:
    """As numbers.  Raises ValueError for what is infinite or none, OverflowError for more."""
    found = [float(v) for v in values]
    if not all(map(math.isfinite, found)):
        raise ValueError(found)
    return found


def _shaped(message: dict[str, Any]) -> bool:
    """Whether a message's settings configure an input shaper."""
    status = message.get("result", {})
    status = status.get("status", {}) if isinstance(status, dict) else {}
    settings = status.get("configfile", {}).get("settings", {}) if status else {}
    shaper = settings.get("input_shaper", {})
    return any(bool(shaper.get(f"shaper_freq_{axis}")) for axis in "xy")


def _chosen(felt: dict[str, Any], sensor: str, path: Path) -> str:
    """Name of the accelerometer."""
    known = ", ".join(felt) or "none"
    if sensor and sensor not in felt:
        raise InputError(f"{path}: no accelerometer {sensor!r}, found {known}")
    if not felt:
        raise InputError(f"{path}: no accelerometer's samples, expected messages adxl345:NAME")
    if not sensor and len(felt) > 1:
        raise InputError(f"{path}: several accelerometers ({known}), expected --sensor NAME")
    return sensor or next(iter(felt))


def _ordered(moves: list[list[float]]) -> Array:
    """Moves by time, each once: captures repeat the one at the border of two messages."""
    table = np.array(moves)
    _, first = np.unique(table[:, 0], return_index=True)
    return table[first]


def _bounds(capture: Capture, span: tuple[float, float] | None, path: Path) -> tuple[float, float]:
    """Print time [s] at which the recording begins and ends."""
    first, last = capture.samples[0, 0], capture.samples[-1, 0]
    if span is not None:
        first, last = first + span[0], min(first + span[1], last)
    moves = capture.moves[(capture.moves[:, 0] < last) & (_ends(capture.moves) > first)]
    if not len(moves):
        raise InputError(f"{path}: no move while samples were taken, expected at least one")
    begin = max(first, moves[0, 0] - LEAD)
    busy = (capture.moves[:, 0] < begin) & (_ends(capture.moves) > begin)
    if busy.any():
        raise InputError(
            f"{path}: a move is under way at {begin - capture.samples[0, 0]:.3f} s, expected a "
            "recording that begins at rest; choose another --span"
        )
    return float(begin), float(last)


def _ends(moves: Array) -> Array:
    return np.asarray(moves[:, 0] + moves[:, 1])


def _motion(moves: Array, begin: float, end: float, centre: Sequence[float]) -> Motion:
    """The moves as a motion that begins at 0; between them it rests."""
    starts, ways = moves[:, 0] - begin, moves[:, 6:8]
    origin = moves[:, 4:6] - np.asarray(centre, dtype=float)

    def position(time: Array) -> Array:
        n = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(moves) - 1)
        since = np.clip(time - starts[n], 0.0, moves[n, 1])
        way = (moves[n, 2] + moves[n, 3] * since / 2) * since
        return np.asarray(origin[n] + way[:, None] * ways[n])

    kinks = np.unique(np.concatenate([starts, starts + moves[:, 1]]))
    inside = kinks[(kinks > 0) & (kinks < end - begin)]
    return Motion(end - begin, position, tuple(inside.tolist()))


def _calm(moves: Array, time: Array) -> NDArray[np.bool_]:
    """Which times [s] lie in rest, `SETTLED` after the last move."""
    n = np.searchsorted(moves[:, 0], time, side="right") - 1
    ended = np.where(n >= 0, _ends(moves)[np.clip(n, 0, None)], -np.inf)
    return np.asarray(time > ended + SETTLED)
