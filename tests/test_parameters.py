"""The nominal parameters are complete, bounded and named for the FMU."""

import tomllib
from pathlib import Path

import pytest

from corexy_fmi.machine import models_folder
from corexy_fmi.parameters import NOMINAL, NUMERICS, defaults, nominal, priors

FIXED = {
    "pulley_radius",
    "bridge_pulley_spacing",
    "motor_idler_span",
    "clip_spacing",
    "belt_damping_time",
    *NUMERICS,
}
SHARP = dict(zip(NUMERICS, (0.0, 1.0), strict=True))  # what no file needs to tell


@pytest.mark.parametrize("parameter", NOMINAL, ids=lambda p: p.name)
def test_default_lies_inside_bounds(parameter):
    for drive in ("stepper", "dc"):
        assert parameter.lower <= parameter.value(drive) <= parameter.upper


@pytest.mark.parametrize("drive", ["stepper", "dc"])
def test_defaults_are_those_of_yin2018(drive):
    name = "yin2018" if drive == "stepper" else "yin2018_dc"
    text = (Path(models_folder()) / name / "machine.toml").read_text(encoding="utf-8")
    assert defaults(drive) == tomllib.loads(text)["parameters"] | SHARP


def test_only_geometry_belt_damping_and_smoothing_are_held_fixed():
    assert {name for name, prior in priors().items() if prior == 0} == FIXED
    assert {prior for name, prior in priors().items() if name not in FIXED} == {0.2}


def test_fmu_names_are_structured_and_unique():
    names = [parameter.fmu_name for parameter in NOMINAL]
    assert len(set(names)) == len(names)
    assert all(name.count(".") == 1 for name in names)


def test_lookup_by_name():
    assert nominal("carriage_mass").unit == "kg"
    with pytest.raises(KeyError):
        nominal("no_such_parameter")
