"""Run CoreXY.ssp with one of three masters.

    python examples/importers/run_ssp.py build/CoreXY.ssp [own|ecos|libcosim] [--out run.npy]

`own` is fmpy's slaves, stepped and connected here as the package says; `ecos` needs `pip install
ecospy` and Debian's libtbb12, `libcosim` needs `pip install libcosimpy`.  All step every 1 ms and
pass on outputs after each step.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import parse

import fmpy
import numpy as np
from build_ssp import SSD, STEP, STOP
from fmpy.fmi2 import FMU2Slave
from numpy.typing import NDArray

from corexy_fmi.fmu.archive import extract_archive

Array = NDArray[np.float64]
POINTS = round(STOP / STEP)
SHOWN = (
    ("source", "phi1"), ("source", "phi2"), ("stage", "x"), ("stage", "y"),
    ("tracker", "x_seen"), ("tracker", "y_seen"),
)  # fmt: skip


class Part:
    """A component of the package: fmpy's slave by names."""

    def __init__(self, fmu: Path, name: str) -> None:
        place = Path(fmpy.extract(str(fmu)))
        description = fmpy.read_model_description(str(place))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=str(place),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()

    def get(self, name: str) -> float:
        """A value."""
        return float(self.slave.getReal([self.references[name]])[0])

    def set(self, name: str, value: float) -> None:
        """Set one."""
        self.slave.setReal([self.references[name]], [value])


def own(ssp: Path) -> Array:
    """SHOWN after every step, (points, 6), by a small master: all step, then all pass on."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        extract_archive(ssp, folder)
        root = parse(folder / "SystemStructure.ssd").getroot()
        parts = {
            str(c.get("name")): Part(folder / str(c.get("source")), str(c.get("name")))
            for c in root.iter(f"{{{SSD}}}Component")
        }
        links = [
            tuple(
                str(c.get(k))
                for k in ("startElement", "startConnector", "endElement", "endConnector")
            )
            for c in root.iter(f"{{{SSD}}}Connection")
        ]
        return _stepped(parts, links)


def _stepped(parts: dict[str, Part], links: list[tuple[str, ...]]) -> Array:
    def pass_on() -> None:
        for start, output, end, name in links:
            parts[end].set(name, parts[start].get(output))

    pass_on()
    for part in parts.values():
        part.slave.exitInitializationMode()
    rows = []
    for n in range(POINTS):
        pass_on()
        for part in parts.values():
            part.slave.doStep(n * STEP, STEP)
        rows.append([parts[name].get(output) for name, output in SHOWN])
    for part in parts.values():
        part.slave.terminate()
        part.slave.freeInstance()
    return np.array(rows)


def ecos(ssp: Path) -> Array:
    """The same by Ecos."""
    from ecospy import EcosSimulation

    rows = []
    with EcosSimulation(STEP, ssp_path=str(ssp)) as simulation:
        simulation.init()
        for _ in range(POINTS):
            simulation.step()
            rows.append([simulation.get_real(f"{name}::{output}") for name, output in SHOWN])
        simulation.terminate()
    return np.array(rows)


def libcosim(ssp: Path) -> Array:
    """The same by OSP's libcosim, which takes an unpacked package."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        extract_archive(ssp, folder)
        execution = CosimExecution.from_ssp_file(str(folder), round(1e9 * STEP))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer=observer)
        wanted = []
        for part, file in (("source", "Source"), ("stage", "CoreXY"), ("tracker", "Tracker")):
            description = fmpy.read_model_description(str(folder / "resources" / f"{file}.fmu"))
            known = {v.name: v.valueReference for v in description.modelVariables}
            own_part = [known[output] for owner, output in SHOWN if owner == part]
            wanted.append((execution.slave_index_from_instance_name(part), own_part))
        rows = []
        for _ in range(POINTS):
            execution.step()
            rows.append([v for i, names in wanted for v in observer.last_real_values(i, names)])
    return np.array(rows)


MASTERS: dict[str, Callable[[Path], Array]] = {"own": own, "ecos": ecos, "libcosim": libcosim}


def main() -> None:
    """Run, and say where the stage and the tracker's sight of it ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("ssp", type=Path)
    parser.add_argument("master", choices=MASTERS, nargs="?", default="own")
    parser.add_argument("--out", type=Path)
    words = parser.parse_args()
    rows = MASTERS[words.master](words.ssp)
    if words.out:
        np.save(words.out, rows)
    reach, (x, y) = 1e3 * rows[:, 2:4].max(axis=0), 1e3 * rows[-1, 4:]
    print(f"{words.master}: reached x {reach[0]:.3f} mm, y {reach[1]:.3f} mm; "
          f"tracker's last sample {x:.2f} mm, {y:.2f} mm")  # fmt: skip


if __name__ == "__main__":
    main()
