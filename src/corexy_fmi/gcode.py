"""A G-code program as a path in time: the words that move a head in the plane, and no others.

G0, G1 (straight), G2, G3 (arcs by I, J), G4 (dwell: P in ms, S in s), G20, G21, G90, G91, G92 and
F [mm/min].  E, Z and other axes are passed over, as are moves without way in the plane, M and T.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.motion import Motion, along, line, rest, row_times
from corexy_fmi.profile import constant_speed, trapezoid
from corexy_fmi.recording.record import Recording

Array = NDArray[np.float64]
WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*")
MOVES, SETTINGS = (0, 1, 2, 3), (20, 21, 90, 91)
IDLE = (17, 28, 29, 40, 49, 54, 64, 80, 94)  # neither place nor time, as far as a path goes
MILLI, INCH = 1e-3, 25.4e-3  # [m]
SAME_RADIUS = 2e-3  # of an arc's radius, or 0.01 mm: how far its end may lie off


@dataclass
class Reader:
    """State of a program: ``place`` [m], NaN where no word named it yet; ``speed`` [m/s]."""

    name: str
    speed: float | None
    acceleration: float | None
    place: Array = field(default_factory=lambda: np.full(2, np.nan))
    unit: float = MILLI
    relative: bool = False
    mode: int = 0
    shift: Array = field(default_factory=lambda: np.zeros(2))
    where: str = ""

    def motion(self, words: dict[str, float], code: float | None) -> Motion | None:
        """What one line makes; None where the head stays."""
        if "F" in words and (code is None or code in MOVES):
            self.speed = words["F"] * self.unit / 60
        if code in SETTINGS:
            self._set(code)
        elif code == 4:
            return self._dwell(words)
        elif code == 92:
            self._rename(words)
        elif code in MOVES or (code is None and not {"X", "Y"}.isdisjoint(words)):
            self.mode = self.mode if code is None else int(code)
            return self._move(words)
        elif code is not None and code not in IDLE:
            known = ", ".join(f"G{n}" for n in sorted((*MOVES, 4, *SETTINGS, 92)))
            raise InputError(f"{self.where}: found G{code:g}, expected one of {known}")
        return None

    def _set(self, code: float | None) -> None:
        if code in (20, 21):
            self.unit = INCH if code == 20 else MILLI
        else:
            self.relative = code == 91

    def _dwell(self, words: dict[str, float]) -> Motion | None:
        seconds = words.get("S", words.get("P", 0.0) * MILLI)
        known = seconds > 0 and not np.isnan(self.place).any()
        return rest(self.place.tolist(), seconds) if known else None

    def _rename(self, words: dict[str, float]) -> None:
        """G92: the place here gets another name; before any move it is what it is called."""
        for axis, name in enumerate("XY"):
            if name in words:
                told = words[name] * self.unit
                if np.isnan(self.place[axis]):
                    self.place[axis] = told
                self.shift[axis] = self.place[axis] - told

    def _target(self, words: dict[str, float]) -> Array:
        target = self.place.copy()
        for axis, name in enumerate("XY"):
            if name in words:
                way = words[name] * self.unit
                target[axis] = self.place[axis] + way if self.relative else self.shift[axis] + way
        return target

    def _move(self, words: dict[str, float]) -> Motion | None:
        start, target = self.place, self._target(words)
        self.place = target
        if np.isnan(start).any() or (self.mode < 2 and np.array_equal(start, target)):
            return None
        if self.speed is None or not self.speed > 0:
            raise InputError(f"{self.where}: no speed, expected F above 0 [mm/min], or --speed")
        if self.mode < 2:
            return line(start.tolist(), target.tolist(), self.speed, self.acceleration)
        return self._arc(start, target, words)

    def _arc(self, start: Array, target: Array, words: dict[str, float]) -> Motion:
        to_centre = self.unit * np.array([words.get("I", 0.0), words.get("J", 0.0)])
        centre, radius = start + to_centre, float(np.hypot(*to_centre))
        off = abs(float(np.hypot(*(target - centre))) - radius)
        if radius == 0 or off > max(SAME_RADIUS * radius, 1e-5):
            raise InputError(
                f"{self.where}: an arc whose ends lie {radius:.6g} m and {radius + off:.6g} m from "
                "its centre, expected I and J of a circle through both"
            )
        turn = 1.0 if self.mode == 3 else -1.0
        first, last = (np.arctan2(*(p - centre)[::-1]) for p in (start, target))
        angle = (turn * (last - first)) % (2 * np.pi)
        length = radius * (angle if angle > 1e-9 else 2 * np.pi)
        drift = target - centre - radius * np.array([np.cos(last), np.sin(last)])
        assert self.speed is not None
        profile = (
            constant_speed(length, self.speed)
            if self.acceleration is None
            else trapezoid(length, self.speed, self.acceleration)
        )

        def curve(s: Array) -> Array:
            at = first + turn * s / radius
            circle = centre + radius * np.column_stack([np.cos(at), np.sin(at)])
            return np.asarray(circle + (s / length)[:, None] * drift)

        return along(curve, length, profile)


def read_gcode(
    path: Path, *, speed: float | None = None, acceleration: float | None = None, rate: float = 1e3
) -> Recording:
    """Positions x, y [m] over time of a program, rows at ``rate`` [Hz] and at every end of a move.

    It begins at the first place that the program names in both axes.  ``speed`` [m/s] holds until
    the first F.  Without ``acceleration`` [m/s^2] each move has constant speed, else it is a
    trapezoid from rest to rest.  Raises InputError, naming the line, for what it does not know.
    """
    reader = Reader(path.name, speed, acceleration)
    begin, times = 0.0, [np.zeros(1)]
    points: list[Array] = []
    for motion in _motions(path, reader):
        if not points:
            points.append(motion.position(np.zeros(1)))
        local = row_times(motion, rate)[1:]
        times.append(begin + local)
        points.append(motion.position(local))
        begin += motion.duration
    if not points:
        raise InputError(f"{path}: no move in X and Y, expected G-code with at least one")
    x, y = np.concatenate(points).T
    return Recording(path.name, np.concatenate(times), {"x": x, "y": y})


def _motions(path: Path, reader: Reader) -> Iterator[Motion]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{path}: {reason}, expected G-code") from error
    for number, text in enumerate(lines, 1):
        reader.where = f"{path}, line {number}"
        for words, code in _commands(text, reader.where):
            motion = reader.motion(words, code)
            if motion is not None and motion.duration > 0:
                yield motion


def _commands(text: str, where: str) -> Iterator[tuple[dict[str, float], float | None]]:
    """The commands of a line, each with its own words; M and T lines make none."""
    bare = re.sub(r"\([^)]*\)", " ", text.partition(";")[0]).strip().strip("%").upper()
    if re.match(r"(N\s*\d+\s*)?[MT]\s*\d", bare):
        return
    bare = bare.partition("*")[0].strip()
    words = [(m.group(1), float(m.group(2))) for m in WORD.finditer(bare)]
    if WORD.sub("", bare).strip():
        raise InputError(f"{where}: found {bare[:40]!r}, expected words such as G1 X10 Y5 F1200")
    codes = [value for name, value in words if name == "G"]
    rest_of = {name: value for name, value in words if name not in "GN"}
    for code in codes[:-1]:
        yield {}, code
    if words:
        yield rest_of, codes[-1] if codes else None
