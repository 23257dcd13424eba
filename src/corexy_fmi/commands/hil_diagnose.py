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
from corexy_fmi.files import PROGRAM, RESULT_FILES, write_folder
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import Machine
from corexy_fmi.motion import half_stage
from corexy_fmi.recording import Recording, read_recording
from corexy_fmi.rectangle import Rectangle

LARGEST = 0.06  # [m] side of a commissioning rectangle; at most half of the stage
TRAIN, HOLDOUT = "commissioning.csv", "holdout.csv"
EXPERIMENT = "experiment{}.csv"
EXPERIMENTS = 2  # at most


def shapes(machine: Machine) -> dict[str, Rectangle]:
    """The runs by their file names: two rectangles of different size, speed and acceleration."""
    wide, high = (min(LARGEST, half) for half in half_stage(machine))
    return {
        TRAIN: Rectangle(wide, 0.7 * high, 0.05, 1, 1.0),
        HOLDOUT: Rectangle(0.7 * wide, 0.8 * high, 0.03, 1, 0.5),
    }


def commission(
    setup: Setup, board: Board, tracker: Tracker, jobs: int, experiments: int = EXPERIMENTS
) -> dict[str, Any]:
    """Run, diagnose, and write recordings and results into ``setup.out``, a folder.

    While the verdict is ambiguous, what it proposes is run, too, at most so many ``experiments``,
    and all is diagnosed again.  Returns the last diagnosis.  Raises InputError where the tracker
    gave nothing; leaves with status 3 where a run stopped.
    """
    began = time.perf_counter()
    runs: list[Recording] = []

    def drive(name: str, order: Recording) -> Recording:
        first = not runs
        one = replace(setup, out=setup.out / name, centred=setup.centred and first,
                      home=setup.home and first)  # fmt: skip
        made = drive_on(one, board, replace(order, metadata={}), tracker)
        return _measured(made, setup.tracker)

    for name, shape in shapes(setup.machine).items():
        runs.append(drive(name, rectangle_command(shape, setup.machine, name)))
    trains, holdouts = runs[:1], runs[1:]
    document = _diagnosed(setup, trains, holdouts, jobs, began)
    for number in range(1, experiments + 1):
        proposed = document["next_experiment"]
        if proposed is None:
            break
        say(f"ambiguous; next: {proposed['why']}")
        order = read_recording(setup.out / proposed["program"])
        use = holdouts if proposed["kept_back"] else trains
        try:
            use.append(drive(EXPERIMENT.format(number), order))
        except InputError as error:
            say(f"the proposed motion is left out: {error}")
            break
        document = _diagnosed(setup, trains, holdouts, jobs, began)
    return document


def _diagnosed(
    setup: Setup, trains: list[Recording], holdouts: list[Recording], jobs: int, began: float
) -> dict[str, Any]:
    """The diagnosis of what was recorded so far, its files in place of the last one's."""
    say("diagnosing")
    with write_folder(setup.out, RESULT_FILES) as folder:
        return write_diagnosis(
            folder, trains, holdouts, setup.machine, False, jobs, None, None, began
        )


def _measured(made: Recording | None, tracker: str | None) -> Recording:
    """A recording with x, y in it."""
    if made is None or not made.measured:
        raise InputError(f"tracker {tracker}: no samples, expected lines 't x y' in s and m")
    return made


def result_files(out: Path) -> list[Path]:
    """What a diagnosis leaves."""
    return [out / name for name in RESULT_FILES if name != PROGRAM]
