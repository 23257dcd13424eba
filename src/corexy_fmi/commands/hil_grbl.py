"""One run on a GRBL controller for the command line: shown first, then driven, recorded, told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
import typer

from corexy_fmi.commands.hil_beside import Beside
from corexy_fmi.commands.hil_run import STOPPED, Setup
from corexy_fmi.commands.screen import console, provenance, say
from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_drive import Drive, Log
from corexy_fmi.hil.grbl_limits import check_controller, check_moves, travel, warnings
from corexy_fmi.hil.grbl_link import BAUD, FULL_FEED, Link
from corexy_fmi.hil.grbl_moves import SHORT, Grid, Move, moves, program
from corexy_fmi.hil.grbl_record import Fit, fit, recording
from corexy_fmi.hil.grbl_report import Build, Family
from corexy_fmi.hil.grbl_timing import Timeline, timeline
from corexy_fmi.hil.motions import APPROACH_SPEED, SETTLE
from corexy_fmi.hil.port import SerialPort
from corexy_fmi.hil.tracker import Tracker, open_lines
from corexy_fmi.recording import Recording, write_recording

HOMING = 180.0  # [s] a homing cycle may take
MODES = "G17G21G90G94"  # plane, mm, absolute, mm/min
TIGHT = 2e-4  # [m] off the foreseen places, by a tenth of the reports: the timing is doubted
DRY = Build(Family.GRBL, "", "C")


@dataclass(frozen=True)
class Job:
    """What is driven: the run's first place and moves, its lines, and how many lead to it."""

    start: tuple[int, int]
    made: list[Move]
    lines: list[str]
    lead: int


def steps_per_mm(setup: Setup) -> float:
    """Of the belt, by the machine's pulley and the counts of a revolution."""
    if setup.machine.drive != "stepper":
        raise InputError(f"machine {setup.machine.name!r}: drive {setup.machine.drive}, but GRBL "
                         "drives steppers only")  # fmt: skip
    if setup.counts_per_turn < 1:
        raise InputError(f"counts per revolution: found {setup.counts}, expected at least 1")
    radius = setup.machine.parameters["pulley_radius"]
    return float(setup.counts_per_turn / (2e3 * np.pi * radius))


def execute_grbl(setup: Setup, order: Recording) -> Recording | None:
    """Plan, check, and with ``arm`` drive; the recording, or None for a dry run.

    Leaves with status 3 where the motion stopped early; its recording up to then is written.
    Raises InputError for what the machine or the controller does not allow.
    """
    per_mm = steps_per_mm(setup)
    radius = setup.machine.parameters["pulley_radius"]
    _dry(setup, order, per_mm, radius)
    if not setup.arm:
        return None
    tracker = Tracker(open_lines(setup.tracker)) if setup.tracker else None
    link = Link(SerialPort(setup.port, BAUD))
    build = ready(link, per_mm)
    centre = home(link) if setup.home else _centred(setup, link)
    grid = Grid(link.settings[100], (0, 0))
    grid = Grid(grid.per_mm, grid.steps(centre))
    job = plan(setup, order, link, build, grid)
    line = timeline(job.start, job.made, grid, link.settings, build.blocks)
    made, log = _drive(setup, link, job, line, grid, tracker)
    _tell(log, grid, setup)
    if log.trouble:
        raise typer.Exit(STOPPED)
    return made


def ready(link: Link, per_mm: float) -> Build:
    """A controller that fits the machine, its feed override at 100 %; warnings are said."""
    build = link.connect()
    check_controller(build, link.settings, per_mm)
    say(f"controller: {build.family.value} {build.version}, {link.settings[100]:g} steps/mm")
    for warning in warnings(link.settings, build):
        say(f"warning: {warning}")
    link.port.write(FULL_FEED)
    return build


def home(link: Link) -> tuple[float, float]:
    """`$H`; where the middle of the controller's travel then lies [mm].

    Raises InputError where homing is off, fails, or the travel is not told.
    """
    if not link.settings.get(22):
        raise InputError("controller: $22=0, homing is off, expected limit switches and $22=1")
    assert link.build is not None
    low, high = travel(link.settings, link.build)
    if not np.all(np.isfinite(low + high)):
        raise InputError("controller: does not tell $130, $131, expected its travel")
    say("homing")
    link.command("$H", HOMING)
    x, y = ((low + high) / 2).tolist()
    return x, y


def _centred(setup: Setup, link: Link) -> tuple[float, float]:
    """Where it stands, which --centred says is the centre [mm]."""
    assert link.last is not None
    if link.last.report.state == "Alarm":
        raise InputError("controller: locked by an alarm, or since power-up; expected --home, or "
                         "an $X by someone who knows why it is locked")  # fmt: skip
    if not setup.centred:
        raise InputError("controller: nobody knows where the carriage stands; add --home, or move "
                         "it to the centre of the stage by hand and add --centred")  # fmt: skip
    return link.locate()


def plan(setup: Setup, order: Recording, link: Link, build: Build, grid: Grid) -> Job:
    """The way to the start, a rest and the motion, all checked."""
    here = grid.steps(link.locate())
    assert link.offset is not None
    start, made = moves(order, setup.machine.parameters["pulley_radius"], grid)
    way = float(np.hypot(start[0] - here[0], start[1] - here[1])) / grid.per_mm / 1e3
    before = [Move(way / APPROACH_SPEED, *start)] if way else []
    before.append(Move(SETTLE, *start))
    for first, row in ((here, before), (start, made)):
        check_moves(first, row, grid, link.settings, build, setup.allowed, setup.machine)
    # the last line is answered when all has been driven: a rest waits for the moves before it
    lines = program(here, [*before, *made], grid, link.offset, build.feed_factor)
    return Job(start, made, [MODES, *lines, "G4P0.01"], 1 + len(before))


def _dry(setup: Setup, order: Recording, per_mm: float, radius: float) -> None:
    """Checks that need no controller; without ``arm``, what would be done."""
    grid = Grid(per_mm, (0, 0))
    start, made = moves(order, radius, grid)
    if all(move[1:] == start for move in made):
        raise InputError(f"{order.name}: nothing moves, expected a motion")
    unbounded = dict.fromkeys((110, 111), np.inf) | dict.fromkeys((120, 121), 0.0)
    check_moves(start, made, grid, unbounded, DRY, setup.allowed, setup.machine)
    if setup.arm:
        return
    short = sum(move.seconds < SHORT for move in made)
    say(f"dry run, nothing moves: {order.time[-1] - order.time[0]:.2f} s in {len(made)} moves, "
        f"{short} of them shorter than {1e3 * SHORT:g} ms; within stage and speed")  # fmt: skip
    say("the controller slows down at corners; its own limits are read and checked with --arm")
    say("add --arm to move the motors, from the centre of the stage with --centred, or --home")


HEADER = (
    "# commanded positions as the controller reported them [m], not measured\n"
    "sent,heard,state,x_commanded,y_commanded\n"
)


class Positions:
    """A side file of the places that the controller reports: commanded, never measured."""

    def __init__(self, path: Path, grid: Grid) -> None:
        self.path, self._grid, self._done = path, grid, 0
        self._file: TextIO | None = None

    def __call__(self, drive: Drive) -> None:
        """Write the reports that are new."""
        for heard in drive.log.reports[self._done :]:
            place = heard.report.place(drive.link.offset)
            if place is not None:
                x, y = (
                    (np.array(place) - np.array(self._grid.centre) / self._grid.per_mm) / 1e3
                ).tolist()
                self._write(f"{heard.sent!r},{heard.heard!r},{heard.report.state},{x!r},{y!r}\n")
        self._done = len(drive.log.reports)

    def _write(self, row: str) -> None:
        try:
            if self._file is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = self.path.open("w", encoding="utf-8", buffering=1)
                self._file.write(HEADER)
            self._file.write(row)
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written: {error.strerror}, expected a disk "
                             "with room") from error  # fmt: skip

    def close(self) -> None:
        """No more rows."""
        if self._file is not None:
            self._file.close()


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
    say(f"{f'stopped: {log.trouble}' if log.trouble else 'complete: every line taken'}; {where}")
    if log.trouble:
        typer.echo(f"{setup.port}: {log.trouble}", err=True)
