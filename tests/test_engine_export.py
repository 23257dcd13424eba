"""What a diagnosis leaves behind: a machine file that reads back, and an FMU of that machine."""

from functools import cache

import fmpy
import numpy as np
import pytest
from engine_kit import diagnosed, machine, other_motion, record
from fmu_kit import LIMIT, folder, rectangle

from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.fmu.signals import fmpy_signals
from corexy_fmi.machine import load_machine, save_machine
from corexy_fmi.simulate import simulate

pytestmark = pytest.mark.long

FOUND = {
    "an effect": ("stribeck", frozenset(), "yin2018"),
    "a law without a name": ("stribeck", frozenset({"stribeck_friction"}), "yin2018"),
    "a loop": ("backlash, dc", frozenset(), "yin2018_dc"),
}


@cache
def exported(name):
    """The explained machine, written and read again, and its FMU."""
    case, without, _ = FOUND[name]
    place, found = folder() / name, diagnosed(case, without=without).machine
    place.mkdir()
    save_machine(found, place / "machine.toml")
    return load_machine(place / "machine.toml"), found, build_fmu(place, found)


@pytest.mark.parametrize("name", FOUND)
def test_the_file_reads_back_the_same(name):
    again, found, _ = exported(name)
    assert again == found


@pytest.mark.parametrize("name", FOUND)
def test_the_fmu_alone_equals_the_machine_file(name):
    """Row by row, without start values."""
    again, _, fmu = exported(name)
    bare = machine(FOUND[name][2])
    order = record(bare, other_motion())
    told, expected = run_fmu(fmu, order), simulate(again, order)
    for axis in ("x", "y"):
        assert np.abs(told[axis] - expected[axis]).max() < LIMIT
    assert np.abs(simulate(bare, order)["x"] - expected["x"]).max() > 1e-5


@pytest.mark.parametrize("name", ["an effect", "a law without a name"])
def test_fmpys_own_simulation_equals_the_machine_file(name):
    """`simulate_fmu` with inputs alone, where every row lies on its grid."""
    again, _, fmu = exported(name)
    order = rectangle(again)
    result = fmpy.simulate_fmu(
        str(fmu),
        input=fmpy_signals(order),
        stop_time=order.time[-1],
        output_interval=1e-3,
        output=["x", "y"],
    )
    expected = simulate(again, order)
    for axis in ("x", "y"):
        seen = np.interp(order.time, result["time"], result[axis])
        assert np.abs(seen - expected[axis]).max() < LIMIT
