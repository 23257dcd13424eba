"""modelDescription.xml of both flavours, from the variable table."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.units import Unit, make_unit
from corexy_fmi.fmu.variables import AT_REST, ENUMERATIONS, Variable

LOG_CATEGORIES = {
    "logEvents": "the machine that was read, the micro-step that was chosen",
    "logStatusError": "a sentence before every fmi2Error; told even when logging is off",
    "logStatusDiscard": "a sentence before every fmi2Discard",
    "logAll": "all of these",
}
EXPERIMENT = {"startTime": "0", "stopTime": "1", "stepSize": "0.001"}
EPOCH = (
    315532800  # [s] 1980-01-01, the zip format's first day: the same sources give the same bytes
)
LICENSE = "Apache-2.0"


@dataclass(frozen=True)
class Flavour:
    """What distinguishes a flavour in the description."""

    name: str
    identifier: str
    capabilities: dict[str, bool]
    output_derivatives: int = 0  # highest order


NATIVE = Flavour(
    "native",
    "CoreXY",
    {
        "needsExecutionTool": False,
        "canHandleVariableCommunicationStepSize": True,
        "canInterpolateInputs": True,
        "canBeInstantiatedOnlyOncePerProcess": False,
        "canNotUseMemoryManagementFunctions": True,
        "canGetAndSetFMUstate": True,
        "canSerializeFMUstate": True,
        "providesDirectionalDerivative": True,
    },
    output_derivatives=1,
)
PYTHON = Flavour(
    "python",
    "CoreXYPython",
    NATIVE.capabilities
    | {
        "needsExecutionTool": True,
        "canInterpolateInputs": False,
        "providesDirectionalDerivative": False,
    },
)
FLAVOURS = {flavour.name: flavour for flavour in (NATIVE, PYTHON)}


def built_at() -> datetime:
    """Time that archives carry: SOURCE_DATE_EPOCH [s] if it is set, else the first day of zip."""
    told = os.environ.get("SOURCE_DATE_EPOCH", str(EPOCH))
    try:
        return datetime.fromtimestamp(max(int(told), EPOCH), UTC)
    except (ValueError, OverflowError, OSError) as error:
        found = f"found {told!r}, expected seconds since 1970"
        raise InputError(f"SOURCE_DATE_EPOCH: {found}") from error


def model_description(
    table: Sequence[Variable],
    flavour: Flavour,
    guid: str,
    machine: str,
    sources: Iterable[str] = (),
) -> bytes:
    """The XML file of a table with its start values; ``sources`` are C files that build it."""
    root = Element("fmiModelDescription", _head(flavour, guid, machine))
    _co_simulation(root, flavour, tuple(sources))
    units = {v.unit: make_unit(v.unit) for v in table if v.unit is not None}
    _unit_definitions(SubElement(root, "UnitDefinitions"), units.values())
    _type_definitions(SubElement(root, "TypeDefinitions"), units.values())
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=meaning)
    SubElement(root, "DefaultExperiment", EXPERIMENT)
    variables = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(table):
        _scalar(variables, variable, reference, units)
    _structure(SubElement(root, "ModelStructure"), table)
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _head(flavour: Flavour, guid: str, machine: str) -> dict[str, str]:
    return {
        "fmiVersion": "2.0",
        "modelName": flavour.identifier,
        "guid": guid,
        "description": f"Core-XY belt stage with its motors; machine {machine}",
        "version": version("corexy_fmi"),
        "license": LICENSE,
        "generationTool": f"corexy_fmi {version('corexy_fmi')}",
        "generationDateAndTime": f"{built_at():%Y-%m-%dT%H:%M:%SZ}",
        "variableNamingConvention": "structured",
        "numberOfEventIndicators": "0",
    }


def _co_simulation(root: Element, flavour: Flavour, sources: Sequence[str]) -> None:
    flags = {name: str(value).lower() for name, value in flavour.capabilities.items()}
    order = {"maxOutputDerivativeOrder": str(flavour.output_derivatives)}
    identifier = {"modelIdentifier": flavour.identifier}
    node = SubElement(root, "CoSimulation", identifier | flags | order)
    if sources:
        files = SubElement(node, "SourceFiles")
        for name in sources:
            SubElement(files, "File", name=name)


def _unit_definitions(node: Element, units: Iterable[Unit]) -> None:
    for unit in units:
        entry = SubElement(node, "Unit", name=unit.name)
        if unit.exponents is not None:
            SubElement(
                entry, "BaseUnit", {base: str(power) for base, power in unit.exponents.items()}
            )
        if unit.display is not None:
            SubElement(entry, "DisplayUnit", name=unit.display[0], factor=repr(unit.display[1]))


def _type_definitions(node: Element, units: Iterable[Unit]) -> None:
    """A type for each unit, with its display unit, and the enumerations."""
    for unit in units:
        attributes = {"unit": unit.name}
        if unit.quantity is not None:
            attributes = {"quantity": unit.quantity} | attributes
        if unit.display is not None:
            attributes["displayUnit"] = unit.display[0]
        SubElement(SubElement(node, "SimpleType", name=unit.type_name), "Real", attributes)
    for name, items in ENUMERATIONS.items():
        enumeration = SubElement(SubElement(node, "SimpleType", name=name), "Enumeration")
        for value, (item, meaning) in enumerate(items.items(), start=1):
            SubElement(enumeration, "Item", name=item, value=str(value), description=meaning)


VARIABILITY = {
    "parameter": "fixed",
    "input": "continuous",
    "output": "continuous",
    "independent": "continuous",
}
INITIAL = {"parameter": "exact", "output": "calculated"}  # input and independent: left out


def _scalar(node: Element, variable: Variable, reference: int, units: dict[str, Unit]) -> None:
    causality = variable.causality
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.description,
        "causality": causality,
        "variability": VARIABILITY[causality],
    }
    if causality in INITIAL:
        attributes["initial"] = INITIAL[causality]
    entry = SubElement(node, "ScalarVariable", attributes)
    kind = variable.kind if variable.kind in ("Real", "Integer") else "Enumeration"
    SubElement(entry, kind, _type_attributes(variable, units))


def _type_attributes(variable: Variable, units: dict[str, Unit]) -> dict[str, str]:
    """Declared type, unit, range, nominal and start; the range holds the neutral value too."""
    real = variable.kind == "Real"
    attributes: dict[str, str] = {}
    if variable.unit is not None:
        unit = units[variable.unit]
        attributes = {"declaredType": unit.type_name, "unit": unit.name}
    elif variable.kind in ENUMERATIONS:
        attributes = {"declaredType": variable.kind}
    neutral = [] if variable.neutral is None else [variable.neutral]
    numbers = {
        "min": None if variable.lower is None else min([variable.lower, *neutral]),
        "max": None if variable.upper is None else max([variable.upper, *neutral]),
        "nominal": variable.nominal,
        "start": variable.start,
    }
    return attributes | {k: _number(v, real) for k, v in numbers.items() if v is not None}


def _number(value: float, real: bool) -> str:
    """Text that reads back to the same bits."""
    return repr(float(value)) if real else str(int(value))


def _structure(node: Element, table: Sequence[Variable]) -> None:
    """Outputs never follow an input at once; at the start some are 0, others depend on all."""
    outputs, unknowns = SubElement(node, "Outputs"), SubElement(node, "InitialUnknowns")
    for index, variable in enumerate(table, start=1):
        if variable.role != "output":
            continue
        SubElement(outputs, "Unknown", index=str(index), dependencies="")
        at_rest = variable.name in AT_REST or variable.name.startswith("tension")
        SubElement(
            unknowns, "Unknown", {"index": str(index)} | ({"dependencies": ""} if at_rest else {})
        )
