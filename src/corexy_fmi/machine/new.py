"""A machine file out of what somebody knows of a stage; the rest is guessed, and marked so.

Every number of the file says where it is from; a guess has a wide prior, so that recordings, not
the guess, decide.  Guesses of friction, idlers and rotors are those of `voron2_250`, a machine of
the class.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import tomli_w

from corexy_fmi.errors import InputError
from corexy_fmi.machine.belts import BELTS, MOUNTS, USUAL
from corexy_fmi.machine.check import machine_from
from corexy_fmi.machine.printer import Printer
from corexy_fmi.machine.record import Machine
from corexy_fmi.parameters import NOMINAL

CLIPS = 0.05  # [m] c, guessed
BESIDE_X, BESIDE_Y = 0.06, 0.10  # [m] W - c over the way of x, H over that of y, guessed
SHAPE = 0.2  # [1] prior of guessed W, H
WEIGHED = 0.05  # [1] prior of what was told
NEEDED = ("rotation_distance", "travel_x", "travel_y")


@dataclass(frozen=True)
class Told:
    """A number in SI units and who says it."""

    value: float
    source: str
    guessed: bool = False


@dataclass(frozen=True)
class Line:
    """One parameter of the file: value, relative prior, where it is from, whether it is a guess."""

    value: float
    rel_std: float
    source: str
    guessed: bool = False


GUESSES = {
    "belt_axial_stiffness": Line(BELTS[USUAL].stiffness(6e-3), MOUNTS, f"{USUAL}, 6 mm", True),
    "carriage_mass": Line(0.4, 0.5, "carriage with a hotend", True),
    "bridge_mass": Line(0.6, 0.5, "bridge with two rail carriages", True),
    "pulley_mass": Line(8e-3, 0.5, "idler on ball bearings", True),
    "pulley_inertia": Line(3e-7, 0.5, "idler on ball bearings", True),
    "motor_inertia": Line(5.4e-6, 0.5, "NEMA-17 rotor", True),
    "belt_damping_time": Line(5e-4, 1.0, "as voron2_250", True),
    "carriage_viscous_friction": Line(15.0, 1.0, "linear rail", True),
    "bridge_viscous_friction": Line(15.0, 1.0, "two linear rails", True),
    "carriage_coulomb_friction": Line(1.0, 1.0, "linear rail", True),
    "bridge_coulomb_friction": Line(1.0, 1.0, "two linear rails", True),
    "pulley_viscous_friction": Line(5e-6, 1.0, "ball bearings", True),
    "pulley_coulomb_friction": Line(2e-4, 1.0, "ball bearings", True),
    "motor_torque_gain": Line(0.095, 0.0, "dc drive only, not read"),
    "motor_damping_gain": Line(3.1e-3, 0.0, "dc drive only, not read"),
    "friction_smoothing": Line(0.0, 0.0, "set-valued friction"),
    "pulley_smoothing_ratio": Line(1.0, 0.0, "pulleys as guides"),
}
PRIORS = {"belt_axial_stiffness": MOUNTS, "bridge_pulley_spacing": 0.0, "motor_idler_span": 0.0,
          "clip_spacing": 0.0}  # fmt: skip


def facts_of(printer: Printer) -> dict[str, Told]:
    """What a printer's configuration tells of the stage."""
    told = {
        "rotation_distance": Told(printer.rotation_distance, printer.where["rotation_distance"]),
        "travel_x": Told(printer.travel[0], printer.where["travel_x"]),
        "travel_y": Told(printer.travel[1], printer.where["travel_y"]),
    }
    if printer.gear != 1.0:
        told["gear"] = Told(printer.gear, printer.where["gear_ratio"])
    return told


def lines(facts: Mapping[str, Told]) -> dict[str, Line]:
    """Every parameter of the file, out of facts by name.

    ``rotation_distance`` [m], ``travel_x``, ``travel_y`` [m] must be there; ``gear`` [1] and any
    parameter may.  Raises InputError for a needed one that is not.
    """
    for name in NEEDED:
        if name not in facts:
            raise InputError(f"{name.replace('_', ' ')}: not told, expected it in m")
    turn = facts["rotation_distance"]
    found = {"pulley_radius": Line(turn.value / (2 * math.pi), 0.0, f"{turn.source}, over 2 pi")}
    found |= _geometry(facts) | GUESSES
    for p in NOMINAL:
        if p.name in facts:
            told = facts[p.name]
            prior = PRIORS.get(p.name, WEIGHED)
            found[p.name] = Line(told.value, prior, told.source, told.guessed)
    if "gear" in facts:
        rotor, gear = found["motor_inertia"], facts["gear"]
        source = f"{rotor.source} behind {gear.source}, squared"
        found["motor_inertia"] = Line(
            rotor.value * gear.value**2, rotor.rel_std, source, rotor.guessed
        )
    return {p.name: found[p.name] for p in NOMINAL}


def _geometry(facts: Mapping[str, Told]) -> dict[str, Line]:
    """c, W and H [m] where nobody told them, from the ways of x and y."""
    clips = facts.get("clip_spacing", Told(CLIPS, "")).value
    along, across = facts["travel_x"], facts["travel_y"]
    return {
        "clip_spacing": Line(CLIPS, 0.3, "belt clips 50 mm apart", True),
        "bridge_pulley_spacing": Line(
            along.value + clips + BESIDE_X, SHAPE,
            f"way of x, {along.source}, with c and 60 mm", True),
        "motor_idler_span": Line(
            across.value + BESIDE_Y, SHAPE, f"way of y, {across.source}, with 100 mm", True),
    }  # fmt: skip


def machine_text(name: str, found: Mapping[str, Line], notes: Sequence[str]) -> str:
    """The machine file; ``notes`` are lines for its head.  Raises InputError where it is none."""
    guessed = [n for n, line in found.items() if line.guessed]
    head = [f"# {note}" for note in notes]
    head += [f"# Guessed, with wide priors: {', '.join(guessed)}."] if guessed else []
    table = {"name": name, "topology": "corexy", "drive": "stepper", "fidelity": "full"}
    if guessed:
        table["surrogate"] = f"guessed: {', '.join(guessed)}"
    rows = ["[parameters]"]
    for p in NOMINAL:
        line = found[p.name]
        pair = f"{{value = {float(line.value)!r}, rel_std = {line.rel_std!r}}}"
        mark = "GUESSED: " if line.guessed else ""
        rows.append(f"{p.name} = {pair}  # {p.symbol} [{p.unit}] {mark}{line.source}")
    text = "\n".join([*head, "", tomli_w.dumps({"machine": table}), *rows, ""])
    as_machine(text, name)
    return text


def as_machine(text: str, name: str) -> Machine:
    """The machine of such a text; raises InputError naming the key that is out of bounds."""
    return machine_from(tomllib.loads(text), "machine new", name)


def notes_of(printer: Printer) -> list[str]:
    """What the configuration says beside the stage's numbers, for the file's head."""
    x, y = printer.centre
    told = [
        f"The stage's centre is X{1e3 * x:g} Y{1e3 * y:g}: --centre {x:g},{y:g} of corexy import.",
        f"Drivers: {printer.microsteps} microsteps, {printer.full_steps} full steps a turn.",
    ]
    if printer.speed and printer.acceleration:
        told.append(
            f"Bears {printer.speed:g} m/s and {printer.acceleration:g} m/s^2 as configured."
        )
    if printer.shaper:
        told.append("An input shaper is configured; commands here are taken as unshaped.")
    return told
