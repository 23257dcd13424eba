"""Klipper's printer.cfg: what it says about a Core-XY stage, each with its file and line.

Read are [printer] (kinematics, max_velocity, max_accel), [stepper_x], [stepper_y]
(rotation_distance or the older step_distance, gear_ratio, microsteps, full_steps_per_rotation,
position_min, position_max) and whether an input shaper is on; `[include FILE]` is followed.
Source: Klipper's Config_Reference.  Lengths there are in mm.
"""

from __future__ import annotations

import glob
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from corexy_fmi.errors import InputError
from corexy_fmi.nearest import nearest

MILLIMETRE = 1e-3  # [m]
MOTORS = ("stepper_x", "stepper_y")
SECTION = re.compile(r"\[([^\]]+)\]")
OPTION = re.compile(r"([^\s:=][^:=]*?)\s*[:=]\s*(.*)")
SAME = 1e-6  # relative difference up to which both motors' pulleys are one


@dataclass(frozen=True)
class Entry:
    """Text of an option and where it stands."""

    text: str
    where: str


Config = dict[str, dict[str, Entry]]


@dataclass(frozen=True)
class Printer:
    """What the file says of the stage.

    ``rotation_distance`` [m] of belt per turn of the driving pulley, ``gear`` turns of the motor
    for one of the pulley, ``low`` and ``high`` [m] ends of x and y, ``speed`` [m/s] and
    ``acceleration`` [m/s^2], None where absent; ``where`` names lines of the file.
    """

    rotation_distance: float
    gear: float
    microsteps: int
    full_steps: int
    low: tuple[float, float]
    high: tuple[float, float]
    speed: float | None
    acceleration: float | None
    shaper: bool
    where: dict[str, str]

    @property
    def travel(self) -> tuple[float, float]:
        """Way of x and y [m]."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of both ways [m]."""
        return (self.high[0] + self.low[0]) / 2, (self.high[1] + self.low[1]) / 2


def read_printer(path: Path) -> Printer:
    """The printer of a configuration; raises InputError naming file, line and option."""
    config = _config(path, ())
    _check_kinematics(config, path)
    turns = [_rotation_distance(config, motor, path) for motor in MOTORS]
    gears = [_gear(config.get(motor, {}).get("gear_ratio")) for motor in MOTORS]
    for what, (one, other) in (("rotation_distance", turns), ("gear_ratio", gears)):
        if abs(one - other) > SAME * abs(one):
            place = _where(config, "stepper_y", what, path)
            raise InputError(
                f"{place}: {what} differs from that of stepper_x, expected equal ones: "
                "the model has one radius for both driving pulleys"
            )
    ends = [_ends(config, motor, path) for motor in MOTORS]
    return Printer(
        turns[0],
        gears[0],
        _count(config, "microsteps", path, 16),
        _count(config, "full_steps_per_rotation", path, 200),
        (ends[0][0], ends[1][0]),
        (ends[0][1], ends[1][1]),
        _milli(_number(config, "printer", "max_velocity", path, math.nan)),
        _milli(_number(config, "printer", "max_accel", path, math.nan)),
        any(key.startswith("shaper_freq") for key in config.get("input_shaper", {})),
        {
            "rotation_distance": _where(config, "stepper_x", "rotation_distance", path),
            "gear_ratio": _where(config, "stepper_x", "gear_ratio", path),
            "travel_x": _where(config, "stepper_x", "position_max", path),
            "travel_y": _where(config, "stepper_y", "position_max", path),
        },
    )


def _config(path: Path, above: tuple[Path, ...]) -> Config:
    """Sections and options; what comes later counts, as in Klipper."""
    if path.resolve() in above:
        raise InputError(f"{path}: includes itself, expected files that do not")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise InputError(f"{path}: {reason}, expected Klipper's printer.cfg") from error
    found: Config = {}
    for section, key, entry in _options(text, path, (*above, path.resolve()), found):
        found.setdefault(section, {})[key] = entry
    return found


def _options(
    text: str, path: Path, above: tuple[Path, ...], found: Config
) -> Iterator[tuple[str, str, Entry]]:
    """Section, name and entry of every option of a file and of those that it includes."""
    section = ""
    for number, raw in enumerate(text.splitlines(), 1):
        line = re.split(r"[#;]", raw, maxsplit=1)[0].rstrip()
        if not line or line[0].isspace():
            continue  # blank, comment, or more of a value that spans lines
        head, option = SECTION.match(line), OPTION.match(line)
        if head:
            section = " ".join(head[1].split())
            if section.startswith("include "):
                yield from _included(section[8:], path, number, above)
            found.setdefault(section, {})
        elif option and section:
            yield section, option[1].strip().lower(), Entry(option[2], f"{path.name}:{number}")
        else:
            raise InputError(
                f"{path}, line {number}: found {line[:40]!r}, expected [section] or option: value"
            )


def _included(
    pattern: str, path: Path, number: int, above: tuple[Path, ...]
) -> Iterator[tuple[str, str, Entry]]:
    files = sorted(path.parent / name for name in glob.glob(pattern, root_dir=path.parent))
    if not files and not glob.has_magic(pattern):
        raise InputError(f"{path}, line {number}: no file {pattern!r}, expected it beside this one")
    for name in files:
        for section, options in _config(name, above).items():
            for key, entry in options.items():
                yield section, key, entry


def _where(config: Config, section: str, key: str, path: Path) -> str:
    entry = config.get(section, {}).get(key)
    return f"{entry.where} [{section}] {key}" if entry else f"{path.name} [{section}]"


def _check_kinematics(config: Config, path: Path) -> None:
    for section in ("printer", *MOTORS):
        if section not in config:
            near = nearest(section, config, 0.6)
            raise InputError(f"{path}: no section [{section}], expected one{near}")
    entry = config["printer"].get("kinematics")
    if entry is None or entry.text != "corexy":
        found = "no kinematics" if entry is None else f"{entry.text!r}"
        place = _where(config, "printer", "kinematics", path)
        raise InputError(f"{place}: found {found}, expected corexy")


def _number(
    config: Config, section: str, key: str, path: Path, default: float | None = None
) -> float:
    """A finite number, or the default where the option is absent."""
    options = config.get(section, {})
    if key not in options:
        if default is not None:
            return default
        near = nearest(key, options, 0.7)
        raise InputError(f"{path}: [{section}] has no {key}, expected one{near}")
    try:
        value = float(options[key].text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        place = _where(config, section, key, path)
        raise InputError(f"{place}: found {options[key].text!r}, expected a number")
    return value


def _count(config: Config, key: str, path: Path, default: int) -> int:
    """A whole number from 1 on of the first motor, or the default where it is absent."""
    value = _number(config, MOTORS[0], key, path, float(default))
    if value < 1 or value != int(value):
        place = _where(config, MOTORS[0], key, path)
        raise InputError(f"{place}: found {value:g}, expected a whole number from 1 on")
    return int(value)


def _rotation_distance(config: Config, motor: str, path: Path) -> float:
    """Belt per turn of the driving pulley [m]."""
    if "rotation_distance" not in config[motor] and "step_distance" in config[motor]:
        step = _number(config, motor, "step_distance", path)
        micro = _number(config, motor, "microsteps", path, math.nan)
        micro = micro if math.isfinite(micro) else _driver_microsteps(config, motor, path)
        turn = step * micro * _number(config, motor, "full_steps_per_rotation", path, 200.0)
    else:
        turn = _number(config, motor, "rotation_distance", path)
    if turn <= 0:
        place = _where(config, motor, "rotation_distance", path)
        raise InputError(f"{place}: found {turn:g} mm, expected a length above 0")
    return turn * MILLIMETRE


def _driver_microsteps(config: Config, motor: str, path: Path) -> float:
    """Microsteps where old configurations have them: beside the driver's chip."""
    chips = [name for name in config if name.startswith("tmc") and name.endswith(motor)]
    section = chips[0] if chips else motor
    return _number(config, section, "microsteps", path)


def _gear(entry: Entry | None) -> float:
    """Turns of the motor for one of the pulley, of text such as 80:16, 2:1."""
    if entry is None:
        return 1.0
    try:
        pairs = [tuple(map(float, part.split(":"))) for part in entry.text.split(",")]
        ratio = math.prod(driven / driving for driven, driving in pairs)
    except (ValueError, ZeroDivisionError):
        ratio = math.nan
    if not (math.isfinite(ratio) and ratio > 0):
        raise InputError(f"{entry.where} gear_ratio: found {entry.text!r}, expected such as 80:16")
    return ratio


def _ends(config: Config, motor: str, path: Path) -> tuple[float, float]:
    """Both ends of a way [m]."""
    low = _number(config, motor, "position_min", path, 0.0)
    high = _number(config, motor, "position_max", path)
    if not high > low:
        place = _where(config, motor, "position_max", path)
        raise InputError(f"{place}: found {high:g} mm, expected more than position_min {low:g} mm")
    return low * MILLIMETRE, high * MILLIMETRE


def _milli(value: float) -> float | None:
    return value * MILLIMETRE if math.isfinite(value) else None
