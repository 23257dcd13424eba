"""The inputs of a recording: filled between samples, and the loop that made them."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.machine import Controller, Machine
from corexy_fmi.recording.record import ANGLES, INPUTS, VOLTAGES, Recording

NUMBER = r"([0-9.]+(?:[eE][-+]?[0-9]+)?)"
LARGEST_GAIN = 1e6  # [V/rad, V s/rad]
LOOP = re.compile(rf"pd\s+kp\s*=\s*{NUMBER}\s+kd\s*=\s*{NUMBER}(?:\s+rate_weight\s*=\s*{NUMBER})?")


def inputs(recording: Recording) -> dict[str, NDArray[np.float64]]:
    """The input channels that are there, each (n,), blanks filled.

    Angles [rad] are linear between samples, voltages [V] are held; both keep their last value.
    """
    present = (name for name in INPUTS if name in recording)
    return {name: _filled(recording, name) for name in present}


def _filled(recording: Recording, name: str) -> NDArray[np.float64]:
    """One input channel without blanks."""
    values = recording[name]
    known = np.flatnonzero(~np.isnan(values))
    if len(known) == len(values):
        return values
    if len(known) == 0:
        raise InputError(f"{recording.name}, column {name}: all blank, expected an input")
    if name in ANGLES:
        return np.interp(recording.time, recording.time[known], values[known])
    last = np.maximum(np.searchsorted(known, np.arange(len(values)), side="right") - 1, 0)
    return values[known[last]]


def controller(recording: Recording) -> Controller | None:
    """The loop that the metadata name, ``pd kp=.. kd=..`` in V/rad and V s/rad; None without one.

    Raises InputError where the line cannot be understood.
    """
    text = recording.metadata.get("controller")
    return None if text is None else parse_controller(text, recording.name)


def parse_controller(text: str, where: str) -> Controller:
    """The gains in ``pd kp=.. kd=..``; ``where`` names the file.

    Raises InputError where the text cannot be understood.
    """
    match = LOOP.fullmatch(text.strip())
    try:
        gains = [float(number) for number in match.groups() if number] if match else []
    except ValueError:
        gains = []
    if not gains or not all(0 <= gain <= LARGEST_GAIN for gain in gains):
        raise InputError(
            f"{where}, metadata controller: found {text!r}, expected 'pd kp=20 kd=0.1'"
        )
    return Controller(*gains)


def is_dc(recording: Recording) -> bool:
    """Whether the recording was made with dc motors: it holds voltages or names its loop."""
    return "controller" in recording.metadata or all(name in recording for name in VOLTAGES)


def check_drive(recording: Recording, machine: Machine) -> None:
    """Raises InputError where the recording lacks the inputs that the machine's drive replays."""
    motors = machine.kind.motors
    angles = all(name in recording for name in ANGLES[:motors])
    if machine.drive == "stepper" and not angles:
        raise InputError(
            f"{recording.name}: no columns phi1, phi2, expected them for machine "
            f"{machine.name!r} (drive stepper); a recording of voltages needs drive = 'dc'"
        )
    loop = machine.controller is not None or "controller" in recording.metadata
    voltages = all(name in recording for name in VOLTAGES[:motors])
    if machine.drive == "dc" and not voltages and not (angles and loop):
        volts, references = (", ".join(names[:motors]) for names in (VOLTAGES, ANGLES))
        raise InputError(
            f"{recording.name}: no columns {volts}, expected them for machine {machine.name!r} "
            f"(drive dc), or references {references} with a controller"
        )
