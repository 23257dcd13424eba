"""What a GRBL run needs before it moves: the right controller, a known place, checked moves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.commands.screen import say
from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_limits import check_controller, check_moves, travel, warnings
from corexy_fmi.hil.grbl_link import FULL_FEED, RESET, Link
from corexy_fmi.hil.grbl_moves import SHORT, Grid, Move, moves, program, straight
from corexy_fmi.hil.grbl_report import Build, Family
from corexy_fmi.hil.motions import APPROACH_SPEED, SETTLE
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.recording import Recording

HOMING = 180.0  # [s] a homing cycle may take
MODES = "G17G21G90G94"  # plane, mm, absolute, mm/min
DRY = Build(Family.GRBL, "", "C")


@dataclass(frozen=True)
class Job:
    """What is driven: the run's first place and moves, its lines, and how many lead to it."""

    start: tuple[int, int]
    made: list[Move]
    lines: list[str]
    lead: int


@contextmanager
def plugged(port: str) -> Iterator[None]:
    """A port that goes away is a line for the user."""
    try:
        yield
    except LinkLostError as error:
        raise InputError(f"{port}: link lost ({error}), expected it to stay there") from error


def steps_per_mm(setup: Setup) -> float:
    """Of the belt, by the machine's pulley and the counts of a revolution."""
    if setup.machine.drive != "stepper":
        raise InputError(f"machine {setup.machine.name!r}: drive {setup.machine.drive}, but GRBL "
                         "drives steppers only")  # fmt: skip
    if setup.counts_per_turn < 1:
        raise InputError(f"counts per revolution: found {setup.counts}, expected at least 1")
    radius = setup.machine.parameters["pulley_radius"]
    return float(setup.counts_per_turn / (2e3 * np.pi * radius))


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
    try:
        link.command("$H", HOMING)
    except BaseException:  # also Ctrl-C: a feed hold does not stop a homing cycle, a reset does
        link.port.write(RESET)
        raise
    x, y = ((low + high) / 2).tolist()
    return x, y


def centred(setup: Setup, link: Link) -> tuple[float, float]:
    """Where it stands, which --centred says is the centre [mm]."""
    assert link.last is not None
    state = link.last.report.state
    if state == "Alarm":
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
    before = [*straight(here, start, APPROACH_SPEED, grid), Move(SETTLE, *start)]
    for first, row in ((here, before), (start, made)):
        check_moves(first, row, grid, link.settings, build, setup.allowed, setup.machine)
    # the last line is answered when all has been driven: a rest waits for the moves before it
    lines = program(here, [*before, *made], grid, link.offset, build.feed_factor)
    return Job(start, made, [MODES, *lines, "G4P0.01"], 1 + len(before))


def dry(setup: Setup, order: Recording, per_mm: float) -> None:
    """Checks that need no controller; without ``arm``, what would be done."""
    grid = Grid(per_mm, (0, 0))
    start, made = moves(order, setup.machine.parameters["pulley_radius"], grid)
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
