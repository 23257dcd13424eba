"""From the tables of a machine file to a `Machine`; every key is read or refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect
from corexy_fmi.errors import InputError
from corexy_fmi.machine.laws import laws_from
from corexy_fmi.machine.record import Controller, Machine
from corexy_fmi.machine.values import choice, number, refuse_unknown, table, text
from corexy_fmi.parameters import NUMERICS, NominalParameter
from corexy_fmi.topologies import COREXY, TOPOLOGIES, Topology

TABLES = ("machine", "controller", "parameters", "effects")
DRIVES = ("stepper", "dc")
FIDELITIES = ("full", "reduced", "kinematic", "condensed")
STEPPER_ONLY = ("kinematic", "condensed")
HEAD = ("name", "topology", "drive", "fidelity", "surrogate")
DC_ONLY = ("motor_torque_gain", "motor_damping_gain")
LARGEST_REL_STD = 10.0


def machine_from(
    document: Mapping[str, Any],
    where: str,
    name: str,
    own: Mapping[str, Effect] | None = None,
) -> Machine:
    """The machine in a parsed TOML document.

    ``where`` names the file, ``name`` is the machine's where the file gives none, ``own`` are
    effects known beside the catalogue's.
    Raises InputError naming the key and the nearest known one.
    """
    refuse_unknown(document, TABLES, where, "table")
    head = table(document.get("machine", {}), f"{where}: machine")
    refuse_unknown(head, HEAD, f"{where}: machine", "key")
    kind = TOPOLOGIES[
        choice(head.get("topology", COREXY), TOPOLOGIES, f"{where}: machine.topology")
    ]
    drive = choice(head.get("drive", kind.drives[0]), DRIVES, f"{where}: machine.drive")
    fidelity = choice(head.get("fidelity", "full"), FIDELITIES, f"{where}: machine.fidelity")
    _check_kind(kind, drive, fidelity, f"{where}: machine")
    if drive == "dc" and fidelity in STEPPER_ONLY:
        raise InputError(
            f"{where}: machine.fidelity: {fidelity!r} knows no dc drive, "
            "expected 'full' or 'reduced'"
        )
    given = table(document.get("parameters", {}), f"{where}: parameters")
    values, rel_std = _parameters(given, f"{where}: parameters", drive, kind)
    known = {**catalogue(), **(own or {})}
    stage = kind.stage(fidelity)
    effects, free_forms = laws_from(document.get("effects", []), known, where, drive, stage)
    return Machine(
        name=text(head.get("name", name), f"{where}: machine.name"),
        topology=kind.name,
        drive=drive,
        fidelity=fidelity,
        parameters=values,
        rel_std=rel_std,
        controller=_controller(document.get("controller"), f"{where}: controller", drive),
        effects=effects,
        free_forms=free_forms,
        surrogate=_surrogate(head, f"{where}: machine.surrogate", given, drive, kind),
    )


def _check_kind(kind: Topology, drive: str, fidelity: str, where: str) -> None:
    """Raises InputError where a topology has no such drive or fidelity."""
    for key, found, known in (
        ("drive", drive, kind.drives),
        ("fidelity", fidelity, kind.fidelities),
    ):
        if found not in known:
            listed = " or ".join(repr(name) for name in known)
            raise InputError(
                f"{where}.{key}: found {found!r}, expected {listed} for topology {kind.name!r}"
            )


def _surrogate(
    head: Mapping[str, Any], where: str, given: Iterable[str], drive: str, kind: Topology
) -> str:
    """The file's own note, else a note of what was filled in from the surrogate."""
    if "surrogate" in head:
        return text(head["surrogate"], where)
    idle = DC_ONLY if drive == "stepper" else ()
    held = {*given, *idle, *NUMERICS} | ({"pulley_radius"} if kind.name != COREXY else set())
    filled = [p.name for p in kind.parameters if p.default and p.name not in held]
    source = "surrogate values of yin2018" if kind.name == COREXY else "made-up values"
    return f"{source} for {', '.join(filled)}" if filled else ""


def _parameters(
    given: Mapping[str, Any], where: str, drive: str, kind: Topology
) -> tuple[dict[str, float], dict[str, float]]:
    """Value and relative prior of every nominal parameter."""
    known = {p.name: p for p in kind.parameters}
    refuse_unknown(given, known, where, "parameter")
    values = {p.name: p.value(drive) for p in kind.parameters}
    rel_std = {p.name: p.rel_std for p in kind.parameters}
    for name, entry in given.items():
        values[name], rel_std[name] = _parameter(entry, known[name], f"{where}.{name}")
    if "clip_spacing" in values and values["clip_spacing"] >= values["bridge_pulley_spacing"]:
        raise InputError(
            f"{where}.clip_spacing: found {values['clip_spacing']!r} m, expected less than "
            f"bridge_pulley_spacing = {values['bridge_pulley_spacing']!r} m"
        )
    return values, rel_std


def _parameter(entry: Any, known: NominalParameter, where: str) -> tuple[float, float]:
    """A number, or a table {value, rel_std}."""
    if not isinstance(entry, dict):
        kind = "a number or a table {value, rel_std}"
        return number(entry, known.lower, known.upper, known.unit, where, kind), known.rel_std
    refuse_unknown(entry, ("value", "rel_std"), where, "key")
    if "value" not in entry:
        raise InputError(f"{where}: no key 'value', expected {{value = .., rel_std = ..}}")
    value = number(entry["value"], known.lower, known.upper, known.unit, f"{where}.value")
    prior = entry.get("rel_std", known.rel_std)
    return value, number(prior, 0.0, LARGEST_REL_STD, "1", f"{where}.rel_std")


def _controller(entry: Any, where: str, drive: str) -> Controller | None:
    """The loop of a dc machine; one beside a stepper is checked, and stands idle."""
    if entry is None:
        return None
    gains = table(entry, where)
    refuse_unknown(gains, ("kp", "kd", "rate_weight"), where, "key")
    for key in ("kp", "kd"):
        if key not in gains:
            raise InputError(f"{where}.{key}: missing, expected a number")
    kp = number(gains["kp"], 0.0, 1e6, "V/rad", f"{where}.kp")
    kd = number(gains["kd"], 0.0, 1e6, "V s/rad", f"{where}.kd")
    weight = number(gains.get("rate_weight", 1.0), 0.0, 1.0, "1", f"{where}.rate_weight")
    return Controller(kp, kd, weight) if drive == "dc" else None
