"""The one table of the FMU's variables: modelDescription.xml, the C table and the docs follow it.

A variable's value reference is its place in the table.  The parameters that the kernel reads stand
together, in the order of its parameter vector (`corexy_fmi.kernel.layout`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import astuple, replace
from uuid import UUID

from corexy_fmi.effects.api import Parameter
from corexy_fmi.fmu.variable import (
    AT_REST,
    ENUMERATIONS,
    Variable,
    choice_variables,
    input_variables,
    output_variables,
)
from corexy_fmi.kernel.layout import (
    FIRST_KNOT,
    FREE_FORM_LOCATIONS,
    FREE_FORM_SIZE,
    KNOTS,
    LAW_KINDS,
    Instance,
    Layout,
)
from corexy_fmi.machine import Machine
from corexy_fmi.machine.check import DRIVES
from corexy_fmi.machine.laws import LARGEST, LARGEST_KNOT, LARGEST_VALUE, UNITS
from corexy_fmi.parameters import NOMINAL
from corexy_fmi.simulate import machine_vector, neutral_vector
from corexy_fmi.topologies import TOPOLOGIES, bounds
from corexy_fmi.topology import STAGES

__all__ = [
    "AT_REST",
    "ENUMERATIONS",
    "Variable",
    "interface_guid",
    "machine_table",
    "variable_table",
]
HOLD = 0  # inputInterpolation


def variable_table(layout: Layout) -> tuple[Variable, ...]:
    """All variables; parameters start with the bare yin2018 machine, every effect neutral."""
    table = [Variable("time", "simulation time", "time", 0, unit="s")]
    table += [*input_variables(), *output_variables(), *choice_variables(), *_nominal()]
    for instance in layout.instances:
        table += _effect(instance)
    for i, location in enumerate(FREE_FORM_LOCATIONS):
        table += _free_form(location, layout.free_form + i * FREE_FORM_SIZE)
    return _with_start(table, neutral_vector(layout).tolist(), (0, 0, HOLD))


def machine_table(machine: Machine, layout: Layout) -> tuple[Variable, ...]:
    """The table with the start values of a machine."""
    choices = DRIVES.index(machine.drive), list(STAGES).index(machine.stage), HOLD
    vector = machine_vector(machine, layout).tolist()
    return _with_start(variable_table(layout), vector, choices)


def interface_guid(table: Sequence[Variable], model_identifier: str) -> str:
    """GUID of an interface: a hash of everything but the start values."""
    told = [astuple(replace(v, start=None)) for v in table]
    digest = hashlib.sha256(repr([model_identifier, ENUMERATIONS, told]).encode()).digest()
    return f"{{{UUID(bytes=digest[:16])}}}"


def _with_start(
    table: Sequence[Variable], vector: Sequence[float], choices: tuple[int, int, int]
) -> tuple[Variable, ...]:
    """Start values from the kernel's vector; choices count from 0."""

    def start(variable: Variable) -> float | None:
        if variable.role == "choice":
            return choices[variable.place] + 1
        if variable.role != "parameter":
            return variable.start
        return float(vector[variable.place]) + (variable.kind in ENUMERATIONS)

    return tuple(replace(v, start=start(v)) for v in table)


def _nominal() -> Iterator[Variable]:
    for place, p in enumerate(NOMINAL):
        meaning, (lower, upper) = f"{p.symbol}: {p.meaning}", bounds(place)
        for topology in list(TOPOLOGIES.values())[1:]:
            other = [o for o in topology.parameters if o.place == place and o.slot]
            meaning += "".join(f"; {topology.name}: {o.name} [{o.unit}]" for o in other)
        yield Variable(
            p.fmu_name, meaning, "parameter", place, unit=p.unit, lower=lower, upper=upper
        )


def _effect(instance: Instance) -> Iterator[Variable]:
    for k, p in enumerate(instance.effect.parameters):
        yield Variable(
            f"effects.{instance.effect.name}.{instance.location}.{p.name}",
            _meaning(instance, p),
            "parameter",
            instance.parameter + k,
            unit=p.unit_at(instance.location),
            lower=p.lower,
            upper=p.upper,
            neutral=p.neutral,
        )


def _meaning(instance: Instance, parameter: Parameter) -> str:
    text = f"{instance.effect.summary}, {instance.location}: {parameter.meaning}"
    return f"{text} ({parameter.neutral:g}: no effect)" if parameter.size else text


def _free_form(location: str, first: int) -> Iterator[Variable]:
    """A law's argument, the number of its knots, what more it has, the knots and their values."""
    name, kind = f"effects.free_form.{location}", "FreeFormArgument"
    rotor = location.startswith("motor")
    unit = "N m" if rotor else "N"
    last = sum(acts == "force" or not rotor for acts, _ in LAW_KINDS)
    text = "what the force or friction depends on", "knots in use (0: no effect)"
    yield Variable(f"{name}.argument", text[0], "parameter", first, kind, lower=1, upper=last)
    yield Variable(
        f"{name}.count", text[1], "parameter", first + 1, "Integer", lower=0, upper=KNOTS
    )
    meanings = (
        "share by which a friction grows with speed",
        "when the time of a law over time begins",
    )
    for k, (part, meaning) in enumerate(zip(LARGEST, meanings, strict=True), 2):
        yield Variable(
            f"{name}.{part}",
            meaning,
            "parameter",
            first + k,
            unit=UNITS[part],
            lower=-LARGEST[part],
            upper=LARGEST[part],
        )
    lists = (
        ("knots", None, "argument at a knot, SI, increasing", LARGEST_KNOT),
        ("values", unit, "force or friction at a knot, linear between knots", LARGEST_VALUE),
    )
    for k, (part, its_unit, meaning, most) in enumerate(lists):
        for i in range(KNOTS):
            place = first + FIRST_KNOT + k * KNOTS + i
            yield Variable(
                f"{name}.{part}[{i + 1}]",
                meaning,
                "parameter",
                place,
                unit=its_unit,
                lower=-most,
                upper=most,
            )
