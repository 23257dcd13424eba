"""The [[effects]] of a machine file: catalogue effects and free-form laws."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from corexy_fmi.effects.api import Effect, Parameter
from corexy_fmi.errors import InputError
from corexy_fmi.machine.record import FREE_FORM, EffectUse, FreeForm
from corexy_fmi.machine.values import choice, number, refuse_unknown, table
from corexy_fmi.nearest import nearest
from corexy_fmi.topologies import TOPOLOGIES, knows

ARGUMENTS = {"force": ("vx", "vy", "x", "y", "phi1", "phi2", "t"), "friction": ("x", "y", "t")}
AXES = ("x", "y")
COORDINATES = {"stepper": ("x", "y"), "dc": ("x", "y", "motor1", "motor2")}
LARGEST_KNOT, LARGEST_VALUE = 1e9, 1e6
MOST_KNOTS = 24
LARGEST = {"viscous": 1e6, "onset": 1e9}  # of what only some laws have
UNITS = {"viscous": "s/m", "onset": "s"}
ONLY = {"viscous": "where a law acts as friction", "onset": "with argument 't'"}


def laws_from(
    entries: Any, known: Mapping[str, Effect], where: str, drive: str, fidelity: str
) -> tuple[tuple[EffectUse, ...], tuple[FreeForm, ...]]:
    """Effects and free-form laws in the order of the file; raises InputError naming the key."""
    if not isinstance(entries, list):
        found = "one table" if isinstance(entries, dict) else repr(entries)
        raise InputError(
            f"{where}: effects: found {found:.60}, expected [[effects]] in double brackets"
        )
    uses: list[EffectUse] = []
    free_forms: list[FreeForm] = []
    for index, raw in enumerate(entries, start=1):
        place = f"{where}: effects[{index}]"
        entry = table(raw, place)
        if entry.get("name") == FREE_FORM:
            free_forms.append(_free_form(entry, place, drive, fidelity))
        else:
            uses.append(_effect_use(entry, known, place, drive, fidelity))
    _refuse_repeated([(use.name, use.location) for use in uses], where)
    _refuse_repeated([(FREE_FORM, law.location) for law in free_forms], where)
    return tuple(uses), tuple(free_forms)


def _effect_use(
    entry: Mapping[str, Any], known: Mapping[str, Effect], where: str, drive: str, fidelity: str
) -> EffectUse:
    """One effect of the catalogue."""
    refuse_unknown(entry, ("name", "location", "parameters"), where, "key")
    effect = _known(_required(entry, "name", where), known, f"{where}.name")
    where = f"{where} {effect.name}"
    _check_drive_and_fidelity(effect, where, drive, fidelity)
    places = _places(effect, fidelity)
    location = choice(_required(entry, "location", where), places, f"{where}.location")
    given = table(entry.get("parameters", {}), f"{where}.parameters")
    refuse_unknown(given, [p.name for p in effect.parameters], f"{where}.parameters", "parameter")
    values = {
        p.name: _value(given, p, location, f"{where}.parameters.{p.name}")
        for p in effect.parameters
    }
    return EffectUse(effect.name, location, values)


def _known(name: Any, known: Mapping[str, Effect], where: str) -> Effect:
    """The effect of that name."""
    if not isinstance(name, str) or name not in known:
        hint = nearest(str(name), [*known, FREE_FORM])
        raise InputError(
            f"{where}: unknown effect {name!r}, expected one of `corexy effects`{hint}"
        )
    return known[name]


def _check_drive_and_fidelity(effect: Effect, where: str, drive: str, fidelity: str) -> None:
    """Raises InputError where the machine cannot have this effect."""
    if drive not in effect.drives:
        raise InputError(
            f"{where}: unknown to drive {drive!r}, expected drive {_either(effect.drives)}"
        )
    if not _places(effect, fidelity):
        if fidelity in TOPOLOGIES:
            raise InputError(f"{where}: unknown to topology {fidelity!r}")
        raise InputError(
            f"{where}: unknown to fidelity {fidelity!r}, "
            f"expected fidelity {_either(effect.fidelities)}"
        )


def _places(effect: Effect, stage: str) -> list[str]:
    """Locations at which a stage knows an effect."""
    known = [place for place in effect.locations if knows(stage, effect, place)]
    return [place for place in known if stage == "full" or not _idler(place)]


def _either(names: tuple[str, ...]) -> str:
    return " or ".join(repr(name) for name in names)


def _idler(location: str) -> bool:
    return location.startswith("pulley")


def _required(entry: Mapping[str, Any], key: str, where: str) -> Any:
    if key not in entry:
        raise InputError(f"{where}: no key {key!r}, expected it")
    return entry[key]


def _value(given: Mapping[str, Any], parameter: Parameter, location: str, where: str) -> float:
    """One parameter: given, or its default; its neutral value is always allowed."""
    value, unit = given.get(parameter.name, parameter.default), parameter.unit_at(location)
    if value is None:
        raise InputError(f"{where}: missing, expected a number [{unit}]")
    if not isinstance(value, bool) and value == parameter.neutral:
        return float(value)
    return number(value, parameter.lower, parameter.upper, unit, where)


def _refuse_repeated(places: list[tuple[str, str]], where: str) -> None:
    """One effect, and one free-form law, stands once at one place."""
    for index, (name, location) in enumerate(places):
        if (name, location) in places[:index]:
            raise InputError(f"{where}: effects: {name} at {location} twice, expected once")


def _free_form(entry: Mapping[str, Any], where: str, drive: str, fidelity: str) -> FreeForm:
    """A law given by its knots."""
    where = f"{where} {FREE_FORM}"
    keys = ("name", "location", "argument", "acts", "knots", "values", *LARGEST)
    refuse_unknown(entry, keys, where, "key")
    if fidelity == "kinematic":
        raise InputError(
            f"{where}: unknown to fidelity 'kinematic', expected 'full', 'reduced' or 'condensed'"
        )
    coordinates = COORDINATES[drive]
    if fidelity in TOPOLOGIES:
        coordinates = TOPOLOGIES[fidelity].forces
    acts = choice(entry.get("acts", "force"), tuple(ARGUMENTS), f"{where}.acts")
    if acts == "friction":
        coordinates = tuple(name for name in coordinates if name in AXES)
    location = choice(_required(entry, "location", where), coordinates, f"{where}.location")
    argument = choice(_required(entry, "argument", where), ARGUMENTS[acts], f"{where}.argument")
    knots = _numbers(_required(entry, "knots", where), LARGEST_KNOT, f"{where}.knots")
    values = _numbers(_required(entry, "values", where), LARGEST_VALUE, f"{where}.values")
    if len(values) != len(knots):
        raise InputError(
            f"{where}.values: found {len(values)} values, expected {len(knots)} as knots"
        )
    if any(after <= before for before, after in pairwise(knots)):
        raise InputError(f"{where}.knots: not increasing, expected strictly increasing knots")
    allowed = {"viscous": acts == "friction", "onset": argument == "t"}
    more = {key: _optional(entry, key, allowed[key], where) for key in LARGEST if key in entry}
    return FreeForm(location, argument, knots, values, acts, **more)


def _optional(entry: Mapping[str, Any], key: str, allowed: bool, where: str) -> float:
    """A number that only some laws have."""
    if not allowed:
        raise InputError(f"{where}.{key}: unknown here, expected it only {ONLY[key]}")
    return number(entry[key], -LARGEST[key], LARGEST[key], UNITS[key], f"{where}.{key}")


def _numbers(entry: Any, largest: float, where: str) -> tuple[float, ...]:
    """At least two finite numbers."""
    if not isinstance(entry, list) or not 2 <= len(entry) <= MOST_KNOTS:
        found = f"a list of {len(entry)}" if isinstance(entry, list) else repr(entry)
        raise InputError(
            f"{where}: found {found:.60}, expected a list of 2 to {MOST_KNOTS} numbers"
        )
    return tuple(
        number(item, -largest, largest, "SI", f"{where}[{i}]") for i, item in enumerate(entry, 1)
    )
