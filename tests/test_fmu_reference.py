"""Reference results inside the archive: any importer's run of the input file gives them."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import fromstring

import fmpy
import numpy as np
import pytest
from fmu_kit import FLAVOURS, diseased, folder, machine, template

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.reference import FOLDER, NAMESPACE
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate


def files(fmu: Path) -> dict[str, np.ndarray]:
    """Tables by role, found by the manifest alone."""
    content = read_archive(fmu)
    root = fromstring(content[f"{FOLDER}/fmi-ls-manifest.xml"])
    assert root.get(f"{{{NAMESPACE}}}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    return {
        str(entry.get("role")): np.genfromtxt(
            io.BytesIO(content[f"{FOLDER}/{entry.get('source')}"]), delimiter=",", names=True
        )
        for entry in root
    }


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("name", ["yin2018", "diseased", "yin2018_dc"])
def test_fmpy_gives_the_reference_results(name: str, flavour: str) -> None:
    """At the default experiment, from the file inside; to twelve digits."""
    chosen = diseased() if name == "diseased" else machine(name)
    fmu = build_fmu(folder() / "reference" / name, chosen, flavour)
    found = files(fmu)
    columns = list(found["result"].dtype.names or ())
    result = fmpy.simulate_fmu(str(fmu), input=found["input"], output=columns[1:])
    rows = np.searchsorted(result["time"], found["result"]["time"] - 1e-9)
    assert len(rows) == 201
    for column in columns:
        scale = np.abs(found["result"][column]).max() + 1e-12
        assert np.abs(result[column][rows] - found["result"][column]).max() < 1e-11 * scale
    assert np.ptp(found["result"]["x"]) > 1e-3
    assert np.ptp(found["result"]["y"]) > 1e-3


def test_the_reference_is_that_of_the_kernel() -> None:
    """Another program, the same motion."""
    found = files(template())
    order, result = found["input"], found["result"]
    time = np.round(np.arange(0, 1001) * 1e-3, 9)
    channels = {n: np.interp(time, order["time"], order[n]) for n in ("phi1", "phi2")}
    expected = simulate(machine(), Recording("reference.csv", time, channels))
    assert np.abs(expected["x"][::5] - result["x"]).max() < 1e-9
    assert np.abs(expected["y"][::5] - result["y"]).max() < 1e-9


def test_results_follow_the_machine() -> None:
    """A diseased machine has others; the template's do not change with the flavour."""
    sick = files(build_fmu(folder() / "reference" / "diseased", diseased()))["result"]
    well, python = (files(template(flavour))["result"] for flavour in FLAVOURS)
    assert np.abs(sick["x"] - well["x"]).max() > 1e-5
    assert np.array_equal(well, python)


def contradictory() -> Machine:
    """A fidelity that knows no dc drive."""
    return replace(machine("yin2018_dc"), fidelity="kinematic")


def test_a_machine_that_its_fmu_would_refuse_is_not_built(tmp_path: Path) -> None:
    """In the FMU's own words."""
    with pytest.raises(InputError, match="kinematic knows no dc drive"):
        build_fmu(tmp_path, contradictory())
    assert list(tmp_path.iterdir()) == []
