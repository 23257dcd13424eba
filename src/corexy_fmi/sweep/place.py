"""Where a varied number lies: a nominal parameter, or ``effect.location.parameter``."""

from __future__ import annotations

from dataclasses import dataclass, replace

from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect, Parameter
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.layout import bundled_layout, nominal_index
from corexy_fmi.machine import Machine
from corexy_fmi.machine.check import DC_ONLY
from corexy_fmi.machine.record import EffectUse
from corexy_fmi.nearest import nearest
from corexy_fmi.parameters import BY_NAME

SHARED = "pulley_radius"


@dataclass(frozen=True)
class Place:
    """A number that can be varied: its key, place in the kernel's vector, unit and bounds."""

    key: str
    index: int
    unit: str
    lower: float
    upper: float


def find_place(key: str, machine: Machine) -> Place:
    """The number of a machine that a key names; raises InputError with the nearest known key."""
    if "." in key:
        return _of_effect(key, machine)
    if key == SHARED:
        raise InputError(
            f"{key}: found among the varied, expected a sweep for each radius: all sets share "
            "the motor angles of one rectangle"
        )
    known = [n for n in BY_NAME if n != SHARED and (machine.drive == "dc" or n not in DC_ONLY)]
    if key not in known:
        every = [*known, *_effect_keys(machine)]
        raise InputError(
            f"{key}: unknown parameter of a {machine.drive} machine, expected one of its "
            f"[parameters] or effect.location.parameter{nearest(key, every)}"
        )
    found = BY_NAME[key]
    return Place(key, nominal_index(key), found.unit, found.lower, found.upper)


def with_effect(machine: Machine, key: str) -> Machine:
    """The machine, with the effect that a key names where it had none of it there."""
    if "." not in key:
        return machine
    name, location, _ = key.split(".")
    if any((use.name, use.location) == (name, location) for use in machine.effects):
        return machine
    return replace(machine, effects=(*machine.effects, EffectUse(name, location, {})))


def _of_effect(key: str, machine: Machine) -> Place:
    """The number of an effect."""
    known = _effect_keys(machine)
    if key not in known:
        raise InputError(
            f"{key}: unknown to a {machine.drive} machine of fidelity {machine.fidelity!r}, "
            f"expected effect.location.parameter{nearest(key, known)}"
        )
    parameter, index = known[key]
    unit = parameter.unit_at(key.split(".")[1])
    return Place(key, index, unit, parameter.lower, parameter.upper)


def _effect_keys(machine: Machine) -> dict[str, tuple[Parameter, int]]:
    """Every number of every effect that the machine can have, and its place."""
    layout, found = bundled_layout(), {}
    for effect in catalogue().values():
        for location in _locations(effect, machine):
            first = layout.find(effect.name, location).parameter
            for k, parameter in enumerate(effect.parameters):
                found[f"{effect.name}.{location}.{parameter.name}"] = parameter, first + k
    return found


def _locations(effect: Effect, machine: Machine) -> list[str]:
    if machine.drive not in effect.drives or machine.fidelity not in effect.fidelities:
        return []
    full = machine.fidelity == "full"
    return [place for place in effect.locations if full or not place.startswith("pulley")]
