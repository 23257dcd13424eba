"""Units of the FMU's variables: names, exponents of the SI base units, display units, types."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass

DERIVED = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Hz": {"s": -1},
}
BASE = ("kg", "m", "s", "A", "rad")
DISPLAY = {  # unit -> display unit and its factor
    "m": ("mm", 1e3),
    "m/s": ("mm/s", 1e3),
    "rad": ("deg", 180 / math.pi),
    "rad/s": ("rpm", 30 / math.pi),
    "kg": ("g", 1e3),
    "s": ("ms", 1e3),
    "N m": ("mN.m", 1e3),
}
QUANTITIES = {
    "m": "Length", "kg": "Mass", "s": "Time", "rad": "Angle", "N": "Force", "V": "Voltage",
    "m/s": "Velocity", "m/s^2": "Acceleration", "rad/s": "AngularVelocity", "N m": "Torque",
    "kg m^2": "MomentOfInertia", "Hz": "Frequency", "1": "Ratio",
}  # fmt: skip
FACTOR = re.compile(r"([A-Za-z]+)(?:\^([0-9]+))?")


@dataclass(frozen=True)
class Unit:
    """A unit as modelDescription.xml names it; ``exponents`` is None where it cannot be parsed."""

    name: str
    exponents: dict[str, int] | None
    display: tuple[str, float] | None
    type_name: str
    quantity: str | None


def make_unit(text: str) -> Unit:
    """The unit written as in CONTRACT 3: factors apart by spaces, powers with ^, one slash."""
    exponents = _exponents(text)
    name = text.replace("^", "").replace(" ", ".") if exponents is not None else text
    quantity = QUANTITIES.get(text)
    plain = re.sub(r"[^A-Za-z0-9]+", "_", text.replace("/", " per ")).strip("_")
    return Unit(name, exponents, DISPLAY.get(text), quantity or f"In_{plain}", quantity)


def _exponents(text: str) -> dict[str, int] | None:
    """Exponents of the base units, or None for a unit of other words."""
    total: Counter[str] = Counter()
    over, *under = text.split("/")
    if len(under) > 1:
        return None
    for sign, part in ((1, over), (-1, "".join(under))):
        for factor in part.split():
            match = FACTOR.fullmatch(factor)
            if factor != "1" and (match is None or match[1] not in (*DERIVED, *BASE)):
                return None
            if match is not None:
                power = sign * int(match[2] or 1)
                for base, count in DERIVED.get(match[1], {match[1]: 1}).items():
                    total[base] += power * count
    return {base: total[base] for base in BASE if total[base]}
