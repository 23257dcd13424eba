"""Numbers with units as people read them: three significant digits, SI prefixes, true minus.

quantity(2.04e-5, "m")                         20.4 µm
with_interval(0.021, (0.0203, 0.0218), "rad")  21.0 mrad, 95 %: 20.3 to 21.8 mrad
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

NARROW = "\u202f"  # no-break space between number and unit
NOTHING = "\u2013"  # stands where there is no number
TIMES, MINUS = "\u00d7", "\u2212"
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# only a unit that starts with one of these takes a prefix, and never one whose base is squared
PREFIXED = re.compile(r"(m|s|rad|N|V|A|Hz|J|W)(?![A-Za-z^])")

CHANNELS = {
    "x": ("x", "m"),
    "y": ("y", "m"),
    "vx": ("x velocity", "m/s"),
    "vy": ("y velocity", "m/s"),
    "ax": ("x acceleration", "m/s^2"),
    "ay": ("y acceleration", "m/s^2"),
    "phi1_meas": ("motor 1 angle", "rad"),
    "phi2_meas": ("motor 2 angle", "rad"),
    "i1": ("motor 1 current", "A"),
    "i2": ("motor 2 current", "A"),
}


def channel_label(channel: str) -> str:
    """Name of a channel in words; an unknown one keeps its own."""
    return CHANNELS.get(channel, (channel, ""))[0]


def channel_unit(channel: str) -> str:
    """SI unit of a channel; empty where it is not known."""
    return CHANNELS.get(channel, ("", ""))[1]


def pretty_unit(unit: str) -> str:
    """``N s^2/m^2`` as N s²/m²; the dimensionless ``1`` as nothing."""
    unit = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(SUPERSCRIPTS), str(unit))
    return {"1": "", "total": "", "-": ""}.get(unit, unit.replace(" ", NARROW))


def prefix_for(size: float, unit: str) -> tuple[float, str]:
    """Scale [display unit per SI unit] and display unit in which ``size`` reads well."""
    if not PREFIXED.match(unit) or not math.isfinite(size) or size == 0:
        return 1.0, pretty_unit(unit)
    power = 3 * math.floor(math.log10(abs(size)) / 3 + 1e-9)
    power = min(max(power, -12), 6)
    if power == 3 and unit[0] in "mrs":  # km, krad, ks: nobody on a stage reads them
        power = 0
    return 10.0**-power, PREFIXES[power] + pretty_unit(unit)


def number(value: float | None, digits: int = 3) -> str:
    """Rounded to significant digits; powers of ten only where plain digits would be unreadable."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    power = math.floor(math.log10(float(f"{abs(value):.{digits - 1}e}")))
    if -4 <= power < max(digits, 5):
        return _minus(f"{value:.{max(digits - 1 - power, 0)}f}")
    mantissa = f"{value / 10.0**power:.{digits - 1}f}"
    return _minus(f"{mantissa} {TIMES} ".replace(" ", NARROW)) + power_of_ten(power)


def power_of_ten(power: int) -> str:
    """10 with a raised power."""
    return f"10{str(power).translate(SUPERSCRIPTS)}"


def quantity(value: float | None, unit: str = "", digits: int = 3) -> str:
    """A value with its unit in a prefix that fits."""
    if value is None or not math.isfinite(value):
        return NOTHING
    scale, shown = prefix_for(float(f"{value:.{digits - 1}e}"), unit)
    return f"{number(value * scale, digits)}{NARROW}{shown}".rstrip(NARROW)


def with_interval(value: float, interval: Sequence[float] | None, unit: str) -> tuple[str, str]:
    """Value and 95 % interval in one shared prefix, with as many digits as the interval bears."""
    if not interval:
        return quantity(value, unit), NOTHING
    scale, shown = prefix_for(value or max(interval, key=abs), unit)
    digits = _digits(value, interval)
    lower, upper = (number(end * scale, digits) for end in interval)
    tail = f"{NARROW}{shown}".rstrip(NARROW)
    return f"{number(value * scale, digits)}{tail}", f"{lower} to {upper}{tail}"


def percent(value: float | None) -> str:
    """A probability or share; never rounded up to certainty."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if 0.9995 <= value < 1:
        return f"> 99.9{NARROW}%"
    if 0 < value < 0.0005:
        return f"< 0.1{NARROW}%"
    digits = 0 if 0.05 <= value <= 0.95 else 1
    return f"{100 * value:.{digits}f}".removesuffix(".0") + f"{NARROW}%"


def millimetres(value: float) -> str:
    """A length [mm] to the micrometre, or finer where it is smaller than ten."""
    shown = f"{abs(value):.3f}" if abs(value) >= 0.0095 else number(abs(value), 2)
    return f"{shown} mm"


def _digits(value: float, interval: Sequence[float]) -> int:
    """Significant digits that still tell the ends of an interval apart, 3 to 6."""
    width = abs(interval[1] - interval[0])
    if not (width > 0 and value != 0 and math.isfinite(width)):
        return 3
    return min(max(1 + math.ceil(math.log10(abs(value) / width)), 3), 6)


def _minus(text: str) -> str:
    """A true minus sign."""
    return text.replace("-", MINUS)
