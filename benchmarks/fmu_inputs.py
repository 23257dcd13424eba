"""What a held input and a corner off the communication grid cost, through the FMU.

    python -m benchmarks.fmu_inputs

drives one rectangle at several communication steps and compares positions at the communication
points with a converged run of the same command; writes benchmarks/results/fmu_inputs.json.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.document import cost_rows
from corexy_fmi.fmu.session import Session, unpacked
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.motion import Motion, row_times
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import machine_vector

MACHINE, SPEED = "yin2018", 0.1  # [m/s]
SIDES = (0.56, 0.42)  # [s]: whole numbers of every step below
STEPS = (0.5e-3, 1e-3, 2e-3, 7e-3)  # [s]
CONVERGED = 5e-6  # [s] micro-step of the reference
RESULT = Path(__file__).parent / "results" / "fmu_inputs.json"
DOCUMENT = Path(__file__).parents[1] / "docs" / "fmu.md"
BEGIN, END = "<!-- fmu_inputs: begin -->", "<!-- fmu_inputs: end -->"
Array = NDArray[np.float64]


def angles(motion: Motion, machine: Machine, time: Array) -> Array:
    """Commanded motor angles (n, 2) in rad at times (n,) in s."""
    x, y = motion.position(time).T
    radius = machine.parameters["pulley_radius"]
    return np.column_stack([(x + y) / radius, (x - y) / radius])


def reference(motion: Motion, machine: Machine, time: Array) -> Array:
    """Converged positions (n, 2) in m at times (n,) in s; every corner is a row of the command."""
    rows = np.union1d(time, row_times(motion, 2000.0))
    rows = rows[np.concatenate([[True], np.diff(rows) > 1e-9])]
    phi = angles(motion, machine, rows)
    vector = machine_vector(machine)[None]
    drive = Excitation(rows, phi[:, 0], phi[:, 1])
    path = run_lanes(bundled_layout(), drive, vector, limit=CONVERGED)[0].T
    nearest = np.clip(np.searchsorted(rows, time - 1e-9), 0, len(rows) - 1)
    return path[nearest]


def through_fmu(fmu: Path, time: Array, phi: Array, ramped: bool) -> Array:
    """Positions (n, 2) in m that the FMU gives at its communication points."""
    rates = np.vstack([np.diff(phi, axis=0) / np.diff(time)[:, None], np.zeros((1, 2))])
    positions = np.empty((len(time), 2))
    with unpacked(fmu) as folder, Session(fmu, folder) as session:
        session.start(time[0], {"phi1": phi[0, 0], "phi2": phi[0, 1]})
        inputs, outputs = session.setter(["phi1", "phi2"]), session.getter(["x", "y"])
        for row, now in enumerate(time):
            positions[row] = outputs.read()
            inputs.values[:] = phi[row].tolist()
            inputs.apply()
            if ramped:
                inputs.rates[:] = rates[row].tolist()
                inputs.apply_rates()
            if row + 1 < len(time):
                session.step(now, time[row + 1] - now)
    return positions


def worst(fmu: Path, machine: Machine, step: float, *, ramped: bool, off_grid: bool) -> float:
    """Largest error [um] of x and y; with ``off_grid`` corners fall into the middle of a step."""
    sides = np.array(SIDES) + (np.array([step / 2, 0.0]) if off_grid else 0.0)
    motion = Rectangle(SPEED * sides[0], SPEED * sides[1], SPEED).motion
    time = step * np.arange(int(motion.duration / step + 1e-9) + 1)
    found = through_fmu(fmu, time, angles(motion, machine, time), ramped)
    return float(1e6 * np.abs(found - reference(motion, machine, time)).max())


def measure(fmu: Path, machine: Machine) -> list[dict[str, float]]:
    """One row for each step."""
    return [
        {
            "step_ms": 1e3 * step,
            "ramped_um": worst(fmu, machine, step, ramped=True, off_grid=False),
            "held_um": worst(fmu, machine, step, ramped=False, off_grid=False),
            "off_grid_um": worst(fmu, machine, step, ramped=True, off_grid=True),
        }
        for step in STEPS
    ]


def table(document: dict[str, Any]) -> str:
    """The table of docs/fmu.md as Markdown."""
    head, *rows = cost_rows(document)
    lines = [head, ["---"] * len(head), *rows]
    body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    source = f"`{document['command']}` at commit {document['commit'][:12]}"
    return f"{document['caption']}; {source}:\n\n{body}"


def render(path: Path, document: dict[str, Any]) -> None:
    """Put the table between its marks in a page."""
    text = path.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    page = f"{before}{BEGIN}\n{table(document)}\n{END}{after}"
    path.write_text(page, encoding="utf-8")


def main() -> None:
    """Measure, print and write."""
    machine = load_machine(MACHINE)
    with tempfile.TemporaryDirectory() as folder:
        rows = measure(build_fmu(Path(folder), machine), machine)
    commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    caption = (
        f"Largest error of x, y at the communication points against a converged run: rectangle of "
        f"{1e3 * SPEED * SIDES[0]:g} mm x {1e3 * SPEED * SIDES[1]:g} mm at {1e3 * SPEED:g} mm/s, "
        f"machine {MACHINE} (a surrogate)"
    )
    document = {
        "commit": commit.strip(),
        "command": "python -m benchmarks.fmu_inputs",
        "caption": caption,
        "rows": rows,
    }
    RESULT.parent.mkdir(exist_ok=True)
    render(DOCUMENT, document)
    RESULT.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(document, indent=1))


if __name__ == "__main__":
    main()
