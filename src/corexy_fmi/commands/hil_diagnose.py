"""``corexy hil diagnose``: commissioning runs on the board, and what they say about the machine."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from corexy_fmi.commands.diagnose import write_diagnosis
from corexy_fmi.commands.hil_run import Setup, drive_on
from corexy_fmi.commands.rectangle import rectangle_command
from corexy_fmi.commands.screen import say
from corexy_fmi.errors import InputError
from corexy_fmi.files import write_folder
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle

LARGEST = 0.06  # [m] side of a commissioning rectangle; at most half of the stage
TRAIN, HOLDOUT = "commissioning.csv", "holdout.csv"


def shapes(machine: Machine) -> dict[str, Rectangle]:
    """The runs by their file names: two rectangles of different size, speed and acceleration."""
    numbers = machine.parameters
    wide = min(LARGEST, (numbers["bridge_pulley_spacing"] - numbers["clip_spacing"]) / 2)
    high = min(LARGEST, numbers["motor_idler_span"] / 2)
    return {
        TRAIN: Rectangle(wide, 0.7 * high, 0.05, 1, 1.0),
        HOLDOUT: Rectangle(0.7 * wide, 0.8 * high, 0.03, 1, 0.5),
    }


def commission(setup: Setup, board: Board, tracker: Tracker, jobs: int) -> dict[str, Any]:
    """Run, diagnose, and write recordings and results into ``setup.out``, a folder.

    Returns the diagnosis.  Raises InputError where the tracker gave nothing; leaves with status 3
    where a run stopped.
    """
    began = time.perf_counter()
    runs: list[Recording] = []
    for name, shape in shapes(setup.machine).items():
        order = replace(rectangle_command(shape, setup.machine, name), metadata={})
        one = replace(setup, out=setup.out / name, centred=setup.centred and not runs)
        runs.append(_measured(drive_on(one, board, order, tracker), setup.tracker))
    say("diagnosing")
    with write_folder(setup.out) as folder:
        return write_diagnosis(
            folder, runs[:1], runs[1:], setup.machine, False, jobs, None, None, began
        )


def _measured(made: Recording | None, tracker: str | None) -> Recording:
    """A recording with x, y in it."""
    if made is None or not made.measured:
        raise InputError(f"tracker {tracker}: no samples, expected lines 't x y' in s and m")
    return made


def result_files(out: Path) -> list[Path]:
    """What a diagnosis leaves."""
    return [out / name for name in ("report.html", "diagnosis.json", "machine.toml", "CoreXY.fmu")]
