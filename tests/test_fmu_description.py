"""The variable table and what follows from it: XML, C table, GUID, units."""

from __future__ import annotations

import re
from dataclasses import replace

import fmpy
import pytest
from fmpy.validation import validate_fmu
from fmu_kit import FLAVOURS, diseased, folder, machine, slave, template

from corexy_fmi.effects import catalogue
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.description import built_at
from corexy_fmi.fmu.machine_text import fnv1a
from corexy_fmi.fmu.units import make_unit
from corexy_fmi.fmu.variables import interface_guid, machine_table, variable_table
from corexy_fmi.kernel.layout import bundled_layout, make_layout
from corexy_fmi.parameters import NOMINAL


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_the_validator_reports_nothing(flavour: str) -> None:
    """For the template and for a machine with effects."""
    assert validate_fmu(str(template(flavour))) == []
    assert validate_fmu(str(build_fmu(folder() / "diseased", diseased(), flavour))) == []


def test_both_flavours_have_the_same_variables() -> None:
    """Names, references, types, units, ranges, start values and structure."""
    native, python = (fmpy.read_model_description(str(template(f))) for f in FLAVOURS)
    for one, other in zip(native.modelVariables, python.modelVariables, strict=True):
        for key in ("name", "valueReference", "type", "causality", "variability", "initial", "unit",
                    "start", "min", "max", "nominal", "description"):  # fmt: skip
            assert getattr(one, key) == getattr(other, key), one.name
    assert [u.variable.name for u in native.outputs] == [u.variable.name for u in python.outputs]
    assert native.guid != python.guid


def test_the_description_holds_what_an_importer_looks_for() -> None:
    """Time, inputs, x and y first, display units, enumerations, capabilities, a date in Z form."""
    description = fmpy.read_model_description(str(template()))
    kinds = {v.name: v for v in description.modelVariables}
    assert [v.name for v in description.modelVariables if v.causality == "independent"] == ["time"]
    assert [u.variable.name for u in description.outputs][:4] == ["x", "y", "x_true", "y_true"]
    assert all(u.dependencies == [] for u in description.outputs)
    assert kinds["x"].declaredType.displayUnit == "mm"
    assert [i.name for i in kinds["drive"].declaredType.items] == ["stepper", "dc"]
    assert [i.name for i in kinds["fidelity"].declaredType.items] == [
        "full",
        "reduced",
        "kinematic",
        "condensed",
        "single_axis",
        "two_mass",
        "cartesian",
        "h_frame",
    ]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", description.generationDateAndTime)
    simulation = description.coSimulation
    assert not simulation.needsExecutionTool
    assert simulation.canInterpolateInputs
    assert simulation.canGetAndSetFMUstate
    assert simulation.canSerializeFMUstate
    assert simulation.providesDirectionalDerivative
    assert simulation.maxOutputDerivativeOrder == 1


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_every_variable_is_described_whole(flavour: str) -> None:
    """Declared types with their units, display units, ranges of parameters, nominals of signals."""
    description = fmpy.read_model_description(str(template(flavour)))
    units = {u.name: u for u in description.unitDefinitions}
    for v in description.modelVariables:
        assert re.fullmatch(r"[A-Za-z]\w*(\.\w+)*(\[\d+\])?", v.name), v.name
        assert v.description, v.name
        if v.unit is not None:
            assert v.declaredType.unit == v.unit
            assert v.unit in units
        if v.causality == "parameter":
            assert None not in (v.min, v.max, v.start), v.name
            assert (v.variability, v.initial) == ("fixed", "exact")
        if v.causality in ("input", "output"):
            assert (v.unit is not None, v.nominal is not None) == (True, True), v.name
    shown = {"m": "mm", "rad": "deg", "m/s": "mm/s", "kg": "g", "rad/s": "rpm"}
    for unit, display in shown.items():
        assert [d.name for d in units[unit].displayUnits] == [display]
        assert units[unit].baseUnit is not None


def test_the_structure_names_outputs_and_what_they_start_from() -> None:
    """Every output; those at rest depend on nothing, the others on all (no list)."""
    description = fmpy.read_model_description(str(template()))
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    assert [u.variable.name for u in description.outputs] == outputs
    unknowns = {u.variable.name: u.dependencies for u in description.initialUnknowns}
    assert list(unknowns) == outputs
    assert unknowns["vx"] == unknowns["tension3"] == []
    assert unknowns["x"] is None
    with slave() as one:
        one.setupExperiment()
        one.enterInitializationMode()
        one.put(phi1=3.0, phi2=1.0)
        at_rest = [name for name, dependencies in unknowns.items() if dependencies == []]
        assert one.read(*at_rest) == [0.0] * len(at_rest)


def test_the_default_experiment_runs_as_it_stands() -> None:
    """fmpy without any argument: a second in steps of a millisecond."""
    result = fmpy.simulate_fmu(str(template()))
    experiment = fmpy.read_model_description(str(template())).defaultExperiment
    told = experiment.startTime, experiment.stopTime, experiment.stepSize
    assert tuple(map(float, told)) == (0.0, 1.0, 1e-3)
    assert len(result) == 1001
    assert result["time"][-1] == 1.0


def test_the_machines_hash_travels_with_it() -> None:
    """The last line of resources/machine.txt; another machine has another one, the GUID is one."""
    hashes, guids = set(), set()
    for fmu in (template(), build_fmu(folder() / "diseased", diseased())):
        content = read_archive(fmu)
        body, _, line = content["resources/machine.txt"].rpartition(b"checksum ")
        assert int(line, 16) == fnv1a(body)
        hashes.add(line)
        guids.add(fmpy.read_model_description(str(fmu)).guid)
    assert (len(hashes), len(guids)) == (2, 1)


def test_each_parameter_stands_in_the_table() -> None:
    """Nominal ones by their FMU name; every effect's at every location, with its neutral value."""
    table = {v.name: v for v in variable_table(bundled_layout())}
    for parameter in NOMINAL:
        assert table[parameter.fmu_name].start == parameter.default
    for effect in catalogue().values():
        for location in effect.locations:
            for p in effect.parameters:
                assert table[f"effects.{effect.name}.{location}.{p.name}"].start == p.neutral
    assert all(v.description for v in table.values())


def test_start_values_of_the_description_are_those_of_the_instance() -> None:
    """Read back from a fresh instance, to the last bit."""
    for fmu in (template(), build_fmu(folder() / "diseased", diseased())):
        with slave(fmu) as one:
            for v in one.description.modelVariables:
                if v.start is None:
                    continue
                get = one.getReal if v.type == "Real" else one.getInteger
                assert get([v.valueReference]) == [float(v.start)], v.name


def test_the_guid_is_a_hash_of_the_interface() -> None:
    """Start values leave it; another range, flavour or effect changes it."""
    layout = bundled_layout()
    table = variable_table(layout)
    guid = interface_guid(table, "CoreXY")
    assert guid == interface_guid(machine_table(diseased(), layout), "CoreXY")
    assert guid != interface_guid(table, "CoreXYPython")
    assert guid != interface_guid([replace(table[0], unit="m"), *table[1:]], "CoreXY")
    fewer = make_layout({k: v for k, v in catalogue().items() if k != "backlash"})
    assert guid != interface_guid(variable_table(fewer), "CoreXY")


@pytest.mark.parametrize(
    ("text", "name", "exponents"),
    [
        ("N s^2/m^2", "N.s2/m2", {"kg": 1, "m": -1}),
        ("N m/V", "N.m/V", {"m": 0, "s": 1, "A": 1}),
        ("kg m^2", "kg.m2", {"kg": 1, "m": 2}),
        ("rad/s", "rad/s", {"rad": 1, "s": -1}),
        ("1", "1", {}),
        ("1 per unit strain", "1 per unit strain", None),
    ],
)
def test_units_are_taken_apart(text: str, name: str, exponents: dict[str, int] | None) -> None:
    """Into exponents of the base units; other words stay a name."""
    unit = make_unit(text)
    assert unit.name == name
    assert unit.exponents == (
        None if exponents is None else {k: v for k, v in exponents.items() if v}
    )


def test_an_effect_of_a_users_own_gets_its_variables() -> None:
    """The table follows the layout, whatever effects are in it."""
    mine = replace(catalogue()["constant_force"], name="push")
    effects = {**catalogue(), "push": mine}
    fmu = build_fmu(folder() / "own", machine(), effects=effects)
    assert validate_fmu(str(fmu)) == []
    with slave(fmu) as one:
        one.setReal([one.references["effects.push.x.force"]], [1.0])
        one.begin()
        one.doStep(0.0, 0.1)
        assert one.read("x")[0] > 1e-6


@pytest.mark.parametrize("told", ["now", "1e9", "1" * 40])
def test_a_wrong_epoch_is_told(monkeypatch: pytest.MonkeyPatch, told: str) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", told)
    with pytest.raises(InputError, match=r"SOURCE_DATE_EPOCH: found .*, expected seconds"):
        built_at()
