"""Other people's importers drive the FMU, as far as they are installed, and are compared with fmpy.

    python -m benchmarks.importers

needs `pip install ecospy libcosimpy fmu-manipulation-toolbox`, Debian's libtbb12 for ecospy; what
is absent is told and left out.  Each importer runs in a process of its own.  Writes
benchmarks/results/importers.json and docs/fmu.md.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fmu_inputs import Array

RESULT = Path(__file__).parent / "results" / "importers.json"
DOCUMENT = Path(__file__).parents[1] / "docs" / "fmu.md"
BEGIN, END = "<!-- importers: begin -->", "<!-- importers: end -->"
POINTS, STEP, LIMIT = 400, 1e-3, 1e-12  # communication points, [s], [m]
INPUTS, OUTPUTS = ("phi1", "phi2", "phi1_rate", "phi2_rate"), ("x", "y", "vx", "phi1_meas")
PACKAGES = {"fmpy": "fmpy", "ecos": "ecospy", "libcosim": "libcosimpy"}
CHECKER = "fmu-manipulation-toolbox"


def command(n: int) -> list[float]:
    """Angles [rad] at a point and their rates [rad/s]: motor 1 turns back half way."""
    time, bend = n * STEP, POINTS // 2 * STEP
    there = time < bend - STEP / 2
    return [
        8.0 * time if there else 8.0 * (2 * bend - time),
        4.0 * time,
        8.0 if there else -8.0,
        4.0,
    ]


def through_fmpy(fmu: str) -> Array:
    """Outputs (points, 4) after each step, by fmpy's slave."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    place = fmpy.extract(fmu)
    description = fmpy.read_model_description(fmu)
    known = {v.name: v.valueReference for v in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=str(place),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="stage",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    rows = []
    for n in range(POINTS):
        slave.setReal([known[name] for name in INPUTS], command(n))
        slave.doStep(n * STEP, STEP)
        rows.append(slave.getReal([known[name] for name in OUTPUTS]))
    slave.terminate()
    slave.freeInstance()
    return np.array(rows)


def through_ecos(fmu: str) -> Array:
    """The same by Ecos."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    structure.add_model("stage", fmu)
    rows = []
    with EcosSimulation(STEP, structure=structure) as simulation:
        simulation.init()
        for n in range(POINTS):
            for name, value in zip(INPUTS, command(n), strict=True):
                simulation.set_real(f"stage::{name}", value)
            simulation.step()
            rows.append([simulation.get_real(f"stage::{name}") for name in OUTPUTS])
        simulation.terminate()
    return np.array(rows)


def through_libcosim(fmu: str) -> Array:
    """The same by OSP's libcosim."""
    import fmpy
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    known = {v.name: v.valueReference for v in fmpy.read_model_description(fmu).modelVariables}
    execution = CosimExecution.from_step_size(step_size=round(1e9 * STEP))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=fmu, instance_name="stage"))
    inputs, outputs = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator=inputs)
    execution.add_observer(observer=outputs)
    wanted, rows = [known[name] for name in OUTPUTS], []
    for n in range(POINTS):
        inputs.slave_real_values(slave, [known[name] for name in INPUTS], command(n))
        execution.step()
        rows.append(outputs.last_real_values(slave, wanted))
    return np.array(rows)


IMPORTERS: dict[str, Callable[[str], Array]] = {
    "fmpy": through_fmpy,
    "ecos": through_ecos,
    "libcosim": through_libcosim,
}


def installed(package: str) -> str | None:
    """Version of a package, None where it is absent."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def driven(importer: str, fmu: Path, folder: Path) -> Array:
    """Outputs (points, 4) of an importer in a process of its own.

    Raises RuntimeError with its last words where it fails.
    """
    target = folder / f"{importer}-{fmu.stem}.npy"
    words = [sys.executable, "-m", "benchmarks.importers", importer, str(fmu), str(target)]
    done = subprocess.run(
        words, capture_output=True, text=True, timeout=250, cwd=Path(__file__).parents[1]
    )
    if not target.exists():
        lines = done.stderr.strip().splitlines() or ["no word"]
        raise RuntimeError(f"{importer}: status {done.returncode}: {lines[-1][:300]}")
    return np.asarray(np.load(target))


def checked(fmu: Path) -> list[str]:
    """Complaints of `fmutool -check`, the checks of fmu-manipulation-toolbox."""
    words = [sys.executable, "-m", "fmu_manipulation_toolbox", "-input", str(fmu), "-check"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=250)
    told = (done.stdout + done.stderr).splitlines()
    if not any("compliant with FMI-2.0" in line for line in told):
        return told[-3:]
    return [line for line in told if line.startswith(("ERROR", "WARN", "FATAL"))]


def compare(fmus: dict[str, Path], folder: Path) -> list[dict[str, Any]]:
    """A row for each importer and flavour: how far it is from fmpy [m, m/s, rad]."""
    rows = []
    for flavour, fmu in fmus.items():
        expected = driven("fmpy", fmu, folder)
        for name, package in PACKAGES.items():
            row: dict[str, Any] = {"flavour": flavour, "importer": package}
            row["version"] = installed(package)
            try:
                found = driven(name, fmu, folder) if row["version"] else None
            except RuntimeError as error:
                row["failed"], found = str(error), None
            if found is not None:
                row["difference"] = float(np.abs(found - expected).max())
                row["stroke_m"] = float(np.ptp(found[:, 0]))
            rows.append(row)
        rows.append({"flavour": flavour, "importer": CHECKER, "version": installed(CHECKER)})
        if rows[-1]["version"]:
            rows[-1]["complaints"] = checked(fmu)
    return rows


def _outcome(row: dict[str, Any]) -> str:
    if not row["version"]:
        return "not installed, not run"
    if "failed" in row:
        return f"fails: {row['failed']}"
    if "complaints" in row:
        return "; ".join(row["complaints"]) or "no complaint"
    return f"{row['difference']:g}"


def table(document: dict[str, Any]) -> str:
    """The table of docs/fmu.md as Markdown."""
    lines = [
        f"{POINTS} steps of {1e3 * STEP:g} ms, angles with rates as inputs; largest difference of "
        f"{', '.join(OUTPUTS)} from fmpy in SI units; `{document['command']}` at commit "
        f"{document['commit'][:12]}:",
        "",
        "| flavour | importer | version | difference, or complaints |",
        "|---|---|---|---|",
    ]
    for row in document["rows"]:
        cells = (row["flavour"], row["importer"], row["version"] or "", _outcome(row))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def render(document: dict[str, Any]) -> None:
    """Put the table between its marks in docs/fmu.md."""
    before, rest = DOCUMENT.read_text(encoding="utf-8").split(BEGIN)
    page = f"{before}{BEGIN}\n{table(document)}\n{END}{rest.split(END)[1]}"
    DOCUMENT.write_text(page, encoding="utf-8")


def main() -> None:
    """One importer, for the process of its own; or all, compared and kept."""
    if len(sys.argv) == 4:
        np.save(sys.argv[3], IMPORTERS[sys.argv[1]](sys.argv[2]))
        return
    from corexy_fmi.fmu.build import build_fmu

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fmus = {kind: build_fmu(folder, None, kind) for kind in ("native", "python")}
        rows = compare(fmus, folder)
    commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    document = {"command": "python -m benchmarks.importers", "commit": commit.strip(), "rows": rows}
    render(document)
    RESULT.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(document, indent=1))


if __name__ == "__main__":
    main()
