"""The vocabulary of the report: names, places and states in plain words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

TIE = "\u00a0"  # no-break space
PLACES = {
    "x": "on the x axis",
    "y": "on the y axis",
    "xy": "on both axes",
    "motor1": "at motor 1",
    "motor2": "at motor 2",
    "motors": "at both motors",
    "belts": "in the belts",
    "bridge": "at the bridge",
    "frame": "in the frame",
    "tool": "at the tool",
    "sensor": "in the sensor",
}
STATES = {
    "velocity_reversal": "where the velocity reverses",
    "speed": "with speed",
    "position": "with position",
    "motor_angle": "with the motor's angle",
    "load": "with the load",
    "acceleration": "with acceleration",
    "voltage": "with the motor voltage",
    "time": "with time",
    "constant": "everywhere alike",
}
NAMES = {
    "free_form": "a free-form law",
    "stribeck_friction": "Stribeck friction",
    "retuned_parameters": "retuned machine parameters alone",
    "belt_stiffness_vs_position": "belt stiffness that varies with position",
    "friction_vs_position": "friction that varies with position",
}
IMPLIED = {"sensor": "sensor", "belts": "belt", "tool": "tool", "frame": "frame"}
ARGUMENTS = {
    "x": "position x",
    "y": "position y",
    "vx": "velocity x",
    "vy": "velocity y",
    "phi1": "angle of motor 1",
    "phi2": "angle of motor 2",
    "t": "time",
}


def effect_name(name: str) -> str:
    """``missed_steps`` as missed steps."""
    return NAMES.get(name, str(name).replace("_", " "))


def place(location: str | None) -> str:
    """``motor1`` as at motor 1, ``pulley7`` as at pulley 7; empty without a location."""
    if not location:
        return ""
    if location.startswith("pulley") and location[6:].isdigit():
        return f"at pulley {location[6:]}"
    return PLACES.get(location, f"at {location}")


def cause(effect: Mapping[str, Any]) -> str:
    """Name and place of an effect: backlash at motor 1."""
    name, location = effect.get("name") or "", effect.get("location")
    implied = location in IMPLIED and IMPLIED[location] in name  # no sensor delay in the sensor
    return f"{effect_name(name)} {'' if implied else place(location)}".strip()


def listed(items: Iterable[str], last: str = "and") -> str:
    """a, b and c."""
    items = list(items)
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def tied(text: str) -> str:
    """The text with spaces that a headline must not break at: motor 1, 0.111 mm."""
    return re.sub(
        r"\b(motor|pulley) (?=\d)|(?<=\d) (?=mm\b)|(?<=\b[xy]) (?=axis)",
        lambda m: (m[1] or "") + TIE,
        text,
    )


def sentence(text: str) -> str:
    """The text with a capital first letter; nothing else is touched."""
    return text[:1].upper() + text[1:]


def full_stop(text: str | None) -> str:
    """The text as a sentence that ends."""
    text = (text or "").strip()
    return text if not text or text[-1] in ".!?" else f"{text}."
