"""One run on a GRBL controller for the command line: shown first, then driven, recorded, told."""

from __future__ import annotations

import numpy as np
import typer

from corexy_fmi.commands.hil_beside import Beside
from corexy_fmi.commands.hil_grbl_plan import (
    Job,
    centred,
    dry,
    home,
    plan,
    plugged,
    ready,
    steps_per_mm,
)
from corexy_fmi.commands.hil_run import STOPPED, Setup
from corexy_fmi.commands.screen import console, provenance, say
from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_drive import Drive, Log
from corexy_fmi.hil.grbl_link import BAUD, Link
from corexy_fmi.hil.grbl_moves import Grid
from corexy_fmi.hil.grbl_positions import Positions
from corexy_fmi.hil.grbl_record import Fit, fit, recording
from corexy_fmi.hil.grbl_timing import Timeline, timeline
from corexy_fmi.hil.port import SerialPort
from corexy_fmi.hil.tracker import Tracker, open_lines
from corexy_fmi.recording import Recording, write_recording

TIGHT = 2e-4  # [m] off the foreseen places, by a tenth of the reports: the timing is doubted
SLOW = 1.1  # of the asked duration, from which it is said that the controller cannot follow


def execute_grbl(setup: Setup, order: Recording) -> Recording | None:
    """Plan, check, and with ``arm`` drive; the recording, or None for a dry run.

    Leaves with status 3 where the motion stopped early; its recording up to then is written.
    Raises InputError for what the machine or the controller does not allow.
    """
    per_mm = steps_per_mm(setup)
    dry(setup, order, per_mm)
    if not setup.arm:
        return None
    tracker = Tracker(open_lines(setup.tracker)) if setup.tracker else None
    link = Link(SerialPort(setup.port, BAUD))
    with plugged(setup.port):
        build = ready(link, per_mm)
        centre = home(link) if setup.home else centred(setup, link)
        grid = Grid(link.settings[100], (0, 0))
        grid = Grid(grid.per_mm, grid.steps(centre))
        job = plan(setup, order, link, build, grid)
    line = timeline(job.start, job.made, grid, link.settings, build.blocks)
    asked = sum(move.seconds for move in job.made)
    say(f"the controller drives in {line.end:.2f} s what was asked in {asked:.2f} s")
    if line.end > SLOW * asked:
        say(f"warning: its acceleration ($120={link.settings[120]:g}, $121={link.settings[121]:g} "
            "mm/s^2) and its corners ($11) do not follow the command")  # fmt: skip
    made, log = _drive(setup, link, job, line, grid, tracker)
    _tell(log, grid, setup)
    if log.trouble:
        raise typer.Exit(STOPPED)
    return made


def _drive(
    setup: Setup, link: Link, job: Job, line: Timeline, grid: Grid, tracker: Tracker | None
) -> tuple[Recording | None, Log]:
    """Drive; the recording where there is one."""
    positions = Positions(setup.out.with_name(f"{setup.out.stem}.commanded.csv"), grid)
    with console(stderr=True).status("driving") as screen:

        def watch(drive: Drive) -> None:
            positions(drive)
            screen.update(f"line {drive.answered} of {len(drive.lines)}")

        log = Drive(link, job.lines, tracker, watch).run()
    positions.close()
    if len(log.answered) <= job.lead:
        say("the motion stopped before the recorded part began: nothing to record")
        return None, log
    until = log.answered[-1] if not log.trouble else max(
        (h.heard for h in log.reports if h.report.state == "Run"), default=0.0)  # fmt: skip
    clock = fit(log, line, grid, log.answered[job.lead - 1], until, link.offset)
    return _written(setup, link, log, line, grid, clock, tracker), log


def _written(
    setup: Setup, link: Link, log: Log, line: Timeline, grid: Grid, clock: Fit,
    tracker: Tracker | None,
) -> Recording | None:  # fmt: skip
    assert link.build is not None
    kept = " ".join(f"${n}={link.settings[n]:g}" for n in sorted(link.settings) if n < 130)
    about = {**provenance(setup.machine, "board"),
             "controller_board": f"{link.build.family.value} {link.build.version}",
             "settings": kept}  # fmt: skip
    radius = setup.machine.parameters["pulley_radius"]
    try:
        made = recording(setup.out.name, log, line, grid, radius, clock, tracker, about)
    except InputError as error:
        say(str(error))
        return None
    if setup.beside:
        made = Beside(setup.machine).compare(made)
    write_recording(made, setup.out)
    say(f"recording: {setup.out}")
    gap = clock.gap / grid.per_mm / 1e3
    if gap > TIGHT:
        say(f"warning: a tenth of the reports lies over {1e6 * gap:.0f} um off the plan: "
            "the controller did not keep this timing (starved, or it plans otherwise)")  # fmt: skip
    return made


def _tell(log: Log, grid: Grid, setup: Setup) -> None:
    """How it went, and where the carriage is."""
    where = "the carriage's place is unknown: --home, or centre it by hand, then --centred"
    if log.known and log.place is not None:
        x, y = grid.metres(np.array([grid.steps(log.place)]))[0]
        where = f"the carriage is at x = {x:.5f} m, y = {y:.5f} m by the controller's steps"
    elif log.known:
        where = "the controller kept the carriage's place: `corexy hil check` wakes it and shows it"
    say(f"{f'stopped: {log.trouble}' if log.trouble else 'complete: every line taken'}; {where}")
    if log.trouble:
        typer.echo(f"{setup.port}: {log.trouble}", err=True)
