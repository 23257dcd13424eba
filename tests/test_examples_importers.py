"""The examples for other tools: the SSP package by every master that is here, the notebook."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from xml.etree.ElementTree import fromstring

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from fmu_kit import folder, machine

from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

PLACE = Path(__file__).parents[1] / "examples" / "importers"
PACKAGES = {"ecos": "ecospy", "libcosim": "libcosimpy"}
RESOLUTION, PERIOD, STEP = 1e-5, 25, 1e-3  # [m], [steps], [s]


def run(*words: str) -> str:
    """What a script prints; it must end well."""
    env = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, env=env)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@cache
def package() -> Path:
    """The package, built as the page says."""
    run(str(PLACE / "build_ssp.py"), "--out", str(folder() / "ssp"))
    return folder() / "ssp" / "CoreXY.ssp"


@cache
def rows(master: str) -> np.ndarray:
    """phi1, phi2 of the source, x, y of the stage, x, y of the tracker, after each step."""
    target = folder() / f"{master}.npy"
    told = run(str(PLACE / "run_ssp.py"), str(package()), master, "--out", str(target))
    assert f"{master}: reached x 39.9" in told.splitlines()[-1]
    return np.asarray(np.load(target))


def test_the_package_is_valid() -> None:
    """By the schema of SSP 1.0 that fmpy brings, and each FMU by fmpy's validator."""
    from lxml import etree

    schema = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureDescription.xsd"
    with zipfile.ZipFile(package()) as archive:
        names = archive.namelist()
        structure = archive.read("SystemStructure.ssd")
        archive.extractall(folder() / "ssp" / "parts")
    etree.XMLSchema(etree.parse(str(schema))).assertValid(etree.fromstring(structure))
    parts = [name for name in names if name.endswith(".fmu")]
    assert len(parts) == 3
    for name in ("Source", "Tracker"):
        assert validate_fmu(str(folder() / "ssp" / "parts" / "resources" / f"{name}.fmu")) == []
    kinds = {e.get("source") for e in fromstring(structure).iter() if e.get("source")}
    assert kinds == set(parts)


def test_the_stage_in_the_package_moves_as_the_kernel() -> None:
    """Under the source's angles, which stand at the communication points."""
    found = rows("own")
    phi = np.vstack([[0.0, 0.0], found[:, :2]])
    time = STEP * np.arange(len(phi))
    order = Recording("source.csv", time, {"phi1": phi[:, 0], "phi2": phi[:, 1]})
    expected = simulate(machine(), order)
    assert np.abs(found[:, 2] - expected["x"][1:]).max() < 1e-9
    assert np.abs(found[:, 3] - expected["y"][1:]).max() < 1e-9
    assert np.ptp(found[:, 2:4], axis=0) == pytest.approx([0.04, 0.03], rel=0.01)


def test_the_tracker_samples_and_rounds() -> None:
    """Every 25 ms what it was handed after the step before; in between it holds."""
    found = rows("own")
    for sample in range(PERIOD, len(found), PERIOD):
        seen = found[sample - 1, 4:]
        assert seen == pytest.approx(found[sample - 2, 2:4], abs=0.51 * RESOLUTION)
        assert (found[sample - 1 : sample - 1 + PERIOD, 4:] == seen).all()


@pytest.mark.parametrize("master", PACKAGES)
def test_other_masters_run_the_package_alike(master: str) -> None:
    """To 1e-12 m, samples of the tracker included."""
    if find_spec(PACKAGES[master]) is None:
        pytest.skip(f"{PACKAGES[master]} is not installed (pip install {PACKAGES[master]})")
    assert np.abs(rows(master)[:, 2:] - rows("own")[:, 2:]).max() < 1e-12


def test_the_notebook_runs_from_top_to_bottom(tmp_path: Path) -> None:
    """Its cells in their order, in a fresh process; it is kept without results."""
    notebook = json.loads((PLACE / "fmu.ipynb").read_text(encoding="utf-8"))
    cells = [c for c in notebook["cells"] if c["cell_type"] == "code"]
    assert all(c["outputs"] == [] and c["execution_count"] is None for c in cells)
    script = tmp_path / "cells.py"
    script.write_text("\n\n".join("".join(c["source"]) for c in cells), encoding="utf-8")
    told = run(str(script))
    assert "Model Name" in told
    assert "largest difference" in told


JUPYTER = """
import os, sys, nbclient, nbformat
del os.environ["MPLBACKEND"]  # Jupyter's own draws into the page
book = nbformat.read(sys.argv[1], as_version=4)
nbclient.NotebookClient(book, timeout=120, kernel_name="python3").execute()
for cell in book.cells:
    for output in cell.get("outputs", []):
        print(output.output_type, output.get("text", ""))
"""


def test_the_notebook_runs_in_jupyter() -> None:
    """By nbclient, in a kernel of its own; the figure is drawn, no cell fails."""
    if find_spec("nbclient") is None or find_spec("ipykernel") is None:
        pytest.skip("nbclient or ipykernel is not installed (pip install nbclient ipykernel)")
    told = run("-c", JUPYTER, str(PLACE / "fmu.ipynb"))
    assert "largest difference" in told
    assert "display_data" in told


def test_what_was_not_run_says_so() -> None:
    """In the file itself and on the page."""
    page = (PLACE / "README.md").read_text(encoding="utf-8")
    for name in ("CoreXYBench.mo", "simulink.md"):
        assert "untested" in (PLACE / name).read_text(encoding="utf-8").lower()
        assert any(name in line and "**untested**" in line for line in page.splitlines())
