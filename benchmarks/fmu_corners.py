"""What the interpolation of commanded angles does to corners, through the FMU.

    python -m benchmarks.fmu_corners

drives one rectangle at several communication steps, corners on communication points, with angles
held, with `inputInterpolation` = ramp and with rates; compares the contour error, eq. (17), with
that of a converged run; writes benchmarks/results/fmu_corners.json and docs/fmu.md.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from benchmarks.fmu_inputs import DOCUMENT, MACHINE, SIDES, SPEED, Array, angles, reference
from benchmarks.outcome import RESULTS, write_outcome
from corexy_fmi.corners import contour_error
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.session import Session, unpacked
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.rectangle import Rectangle

RECTANGLE = Rectangle(SPEED * SIDES[0], SPEED * SIDES[1], SPEED)
STEPS = (0.5e-3, 1e-3, 2e-3, 4e-3, 7e-3)  # [s]
FINE = 5e-5  # [s] between the points of a path
MODES = {"hold": "held", "ramp": "`inputInterpolation` = ramp", "rates": "with rates"}
RESULT = RESULTS / "fmu_corners.json"
BEGIN, END = "<!-- fmu_corners: begin -->", "<!-- fmu_corners: end -->"


def driven(fmu: Path, time: Array, phi: Array, mode: str) -> Array:
    """x, y [m], vx, vy [m/s] (n, 4) at the communication points (n,) [s]."""
    rates = np.vstack([np.diff(phi, axis=0) / np.diff(time)[:, None], np.zeros((1, 2))])
    rows = np.empty((len(time), 4))
    with unpacked(fmu) as folder, Session(fmu, folder) as session:
        choice = {"inputInterpolation": 2 if mode == "ramp" else 1}
        session.start(time[0], {"phi1": phi[0, 0], "phi2": phi[0, 1]}, choice)
        inputs = session.setter(["phi1", "phi2"])
        outputs = session.getter(["x", "y", "vx", "vy"])
        for row, now in enumerate(time):
            rows[row] = outputs.read()
            inputs.values[:] = phi[row].tolist()
            inputs.apply()
            if mode == "rates":
                inputs.rates[:] = rates[row].tolist()
                inputs.apply_rates()
            if row + 1 < len(time):
                session.step(now, time[row + 1] - now)
    return rows


def corner_errors(time: Array, path: Array) -> Array:
    """Eq. (17) [m] at the three corners of a path (n, 2) at times (n,) in s."""
    vertices, times = RECTANGLE.vertices, RECTANGLE.vertex_times
    middles = (times[:-1] + times[1:]) / 2
    errors = []
    for k in range(1, len(vertices) - 1):
        near = (time > middles[k - 1]) & (time < middles[k])
        sides = vertices[k] - vertices[k - 1], vertices[k + 1] - vertices[k]
        errors.append(contour_error(path[near], vertices[k], *sides))
    return np.array(errors)


def shift(fmu: Path, machine: Machine, step: float, mode: str) -> float:
    """Largest change [um] of a corner's error; between points the path follows its velocities."""
    time = step * np.arange(int(RECTANGLE.motion.duration / step + 1e-9) + 1)
    fine = np.linspace(0.0, time[-1], int(time[-1] / FINE) + 1)
    rows = driven(fmu, time, angles(RECTANGLE.motion, machine, time), mode)
    path = CubicHermiteSpline(time, rows[:, :2], rows[:, 2:])(fine)
    converged = reference(RECTANGLE.motion, machine, fine)
    change = corner_errors(fine, path) - corner_errors(fine, converged)
    return float(1e6 * np.abs(change).max())


def measure(fmu: Path, machine: Machine) -> list[dict[str, float]]:
    """One row for each step."""
    return [
        {"step_ms": 1e3 * step} | {f"{mode}_um": shift(fmu, machine, step, mode) for mode in MODES}
        for step in STEPS
    ]


def table(document: dict[str, Any]) -> str:
    """The table of docs/fmu.md as Markdown."""
    head = ["step [ms]", *(f"{words} [um]" for words in MODES.values())]
    keys = ["step_ms", *(f"{mode}_um" for mode in MODES)]
    rows = [[f"{float(f'{row[key]:.2g}'):g}" for key in keys] for row in document["rows"]]
    body = "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *rows])
    source = f"`{document['command']}` at commit {document['commit'][:12]}"
    return f"{document['caption']}; {source}:\n\n{body}"


def render(document: dict[str, Any]) -> None:
    """Put the table between its marks in docs/fmu.md."""
    before, rest = DOCUMENT.read_text(encoding="utf-8").split(BEGIN)
    page = f"{before}{BEGIN}\n{table(document)}\n{END}{rest.split(END)[1]}"
    DOCUMENT.write_text(page, encoding="utf-8")


def main() -> None:
    """Measure, print and write."""
    machine = load_machine(MACHINE)
    with tempfile.TemporaryDirectory() as folder:
        rows = measure(build_fmu(Path(folder), machine), machine)
    caption = (
        f"Change of the contour error, eq. (17), of the worst of three corners against a converged "
        f"run (there 0.6 to 1.4 mm): rectangle of {1e3 * RECTANGLE.width:g} mm x "
        f"{1e3 * RECTANGLE.height:g} mm at {1e3 * SPEED:g} mm/s, corners on communication points, "
        f"machine {MACHINE} (a surrogate)"
    )
    found = {"caption": caption, "rows": rows}
    print(write_outcome("fmu_corners", "python -m benchmarks.fmu_corners", found))
    render(json.loads(RESULT.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
