"""``corexy demo``: the main job on bundled recordings."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.bundled import bundled_folder
from corexy_fmi.commands.diagnose import read_all, write_diagnosis
from corexy_fmi.commands.places import folder_place, keep_apart
from corexy_fmi.commands.rectangle import rectangle_command, show_corners
from corexy_fmi.commands.screen import ASSUMED, label, progress, say
from corexy_fmi.commands.verdict import show_verdict
from corexy_fmi.corners import corner_table
from corexy_fmi.errors import InputError
from corexy_fmi.figure import draw_rectangle
from corexy_fmi.files import RESULT_FILES, write_folder
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.recording import write_recording
from corexy_fmi.rectangle import Rectangle

SPEEDS = (0.020, 0.039, 0.079)  # [m/s] of the paper
SIZE = (0.06, 0.04)  # [m]


def demo(
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for results.", parser=folder_place),
    ] = Path("out/demo"),
) -> None:
    """Build the FMU, drive the rectangle runs with fmpy, diagnose the bundled recordings.

    Examples:

    corexy demo --out demo
    """
    cases = bundled_cases()
    for case in cases:
        keep_apart([out / case.name / name for name in RESULT_FILES], case.iterdir())
    machine = load_machine(ASSUMED)
    label(machine)
    run_rectangles(machine, out)
    for case in cases:
        _diagnose(case, out / case.name)


def run_rectangles(machine: Machine, out: Path) -> None:
    """One FMU, and the rectangle run at each speed of the paper: recordings and figures."""
    from corexy_fmi.fmu.build import build_fmu
    from corexy_fmi.fmu.runner import run_fmu

    with write_folder(out) as folder:
        fmu = build_fmu(folder, machine)
        for speed in SPEEDS:
            shape = Rectangle(*SIZE, speed)
            name = f"rectangle_{1e3 * speed:.0f}_mm_s"
            response = run_fmu(fmu, rectangle_command(shape, machine, f"{name}.csv"), machine)
            corners = corner_table(response, shape)
            write_recording(response, folder / f"{name}.csv")
            draw_rectangle(response, shape, corners, machine, folder / f"{name}.png")
            say(f"rectangle at {1e3 * speed:g} mm/s through the FMU: {out / name}.csv, .png")
            show_corners(corners)
        name = fmu.name
    say(f"FMU: {out / name}")


def bundled_cases() -> list[Path]:
    """Folders of the bundled recordings: train*.csv, holdout*.csv and perhaps machine.toml."""
    folder = bundled_folder("examples")
    cases = sorted({path.parent for path in folder.glob("*/train*.csv")})
    if not cases:
        raise InputError(f"{folder}: no recordings, expected */train*.csv")
    return cases


def _diagnose(case: Path, out: Path) -> None:
    """One bundled case, from its recordings to its report."""
    began = time.perf_counter()
    own = case / "machine.toml"
    machine = load_machine(own if own.is_file() else ASSUMED)
    trains, holdouts = read_all(sorted(case.glob("train*.csv")), sorted(case.glob("holdout*.csv")))
    with progress() as move, write_folder(out, RESULT_FILES) as folder:
        document = write_diagnosis(folder, trains, holdouts, machine, False, 2, None, move, began)
    say(f"bundled recordings {case.name}:")
    label(machine)
    show_verdict(document)
    say(f"report: {out / 'report.html'}")
