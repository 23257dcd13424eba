"""What a GRBL controller says, line by line: who it is, how it is set, what it does."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from math import sqrt

from corexy_fmi.errors import InputError

BUFFER, BLOCKS = 128, 15  # [bytes, motions] of GRBL 1.1 where $I does not say
INCH = 25.4  # [mm]
BANNER = re.compile(r"^(Grbl|GrblHAL)\s+\S+.*\[.*\]", re.IGNORECASE)
OPTIONS = re.compile(r"^\[OPT:([^,\]]*)(?:,(\d+))?(?:,(\d+))?.*\]$")
SETTING = re.compile(r"^\$(\d+)=([-+0-9.eE]+)")


class Family(Enum):
    """Whose firmware it is."""

    GRBL = "GRBL"
    GRBLHAL = "grblHAL"
    FLUIDNC = "FluidNC"


@dataclass(frozen=True)
class Build:
    """Family, version, option letters; motions that it plans ahead, bytes that it buffers."""

    family: Family
    version: str
    options: str
    blocks: int = BLOCKS
    buffer: int = BUFFER
    kinematics: str = ""

    @property
    def corexy(self) -> bool | None:
        """Whether it drives a Core-XY; None where the firmware does not tell."""
        if self.family is Family.GRBL:
            return "C" in self.options
        if self.kinematics:
            return "corexy" in self.kinematics.lower()
        return True if "C" in self.options else None

    @property
    def feed_factor(self) -> float:
        """F for 1 mm/min of the head.

        GRBL 1.1 takes F along both motors, sqrt(2) times the head's way (gnea/grbl #1122); the
        others correct that.  For G94 only: in G93 GRBL's time is right and the others' is not.
        """
        return sqrt(2) if self.family is Family.GRBL else 1.0


def build(lines: Iterable[str]) -> Build:
    """From the banner and the answer to ``$I``; raises InputError for what is no GRBL 1.1."""
    lines = list(lines)
    whole = "\n".join(lines).lower()
    family = Family.GRBL
    if "fluidnc" in whole:
        family = Family.FLUIDNC
    elif "grblhal" in whole:
        family = Family.GRBLHAL
    version = next((line[5:].rstrip("]") for line in lines if line.startswith("[VER:")), "")
    if not version:
        raise InputError("controller: no [VER:] in its answer to $I, expected GRBL 1.1, grblHAL or "
                         "FluidNC")  # fmt: skip
    if family is Family.GRBL and not version.startswith("1.1"):
        raise InputError(f"controller: GRBL {version.split(':')[0]}, expected 1.1")
    options = next((m for m in map(OPTIONS.match, lines) if m), None)
    kinematics = next((line[12:-1] for line in lines if line.startswith("[KINEMATICS:")), "")
    letters, blocks, size = options.groups() if options else ("", None, None)
    return Build(family, version.rstrip(":"), letters, int(blocks or BLOCKS),
                 int(size or BUFFER), kinematics)  # fmt: skip


def settings(lines: Iterable[str]) -> dict[int, float]:
    """The answer to ``$$`` by number."""
    return {int(m[1]): float(m[2]) for m in map(SETTING.match, lines) if m}


@dataclass(frozen=True)
class Report:
    """One ``<...>``: state with its sub-state, positions [mm] as far as it gives them."""

    state: str
    sub: int | None
    machine: tuple[float, float] | None
    work: tuple[float, float] | None
    offset: tuple[float, float] | None
    pins: str = ""
    feed: float | None = None
    free: tuple[int, int] | None = None

    def place(self, offset: tuple[float, float] | None) -> tuple[float, float] | None:
        """Machine position [mm]; from the work position with the last offset heard."""
        offset = self.offset or offset
        if self.machine is not None:
            return self.machine
        if self.work is None or offset is None:
            return None
        return self.work[0] + offset[0], self.work[1] + offset[1]


def report(line: str, unit: float = 1.0) -> Report | None:
    """A status report, lengths times ``unit`` [mm]; None for a line that is none."""
    if not (line.startswith("<") and line.endswith(">")):
        return None
    state, *rest = line[1:-1].split("|")
    fields = dict(part.split(":", 1) for part in rest if ":" in part)
    name, _, sub = state.partition(":")
    try:
        return Report(
            name, int(sub) if sub else None,
            _pair(fields, "MPos", unit), _pair(fields, "WPos", unit), _pair(fields, "WCO", unit),
            fields.get("Pn", ""), _feed(fields), _free(fields),
        )  # fmt: skip
    except ValueError:
        return None


def _pair(fields: Mapping[str, str], key: str, unit: float) -> tuple[float, float] | None:
    if key not in fields:
        return None
    x, y = (unit * float(word) for word in fields[key].split(",")[:2])
    return x, y


def _feed(fields: Mapping[str, str]) -> float | None:
    text = fields.get("FS", fields.get("F"))
    return None if text is None else float(text.split(",")[0])


def _free(fields: Mapping[str, str]) -> tuple[int, int] | None:
    if "Bf" not in fields:
        return None
    blocks, size = fields["Bf"].split(",")[:2]
    return int(blocks), int(size)
