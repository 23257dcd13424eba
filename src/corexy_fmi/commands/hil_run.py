"""One run on the board for the command line: shown first, then driven, recorded and told."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import typer

from corexy_fmi.commands.hil_beside import Beside
from corexy_fmi.commands.screen import console, provenance, say
from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import AHEAD, Drive, Log
from corexy_fmi.hil.homing import Homing, Switches, home
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.live import LiveFile, part_of
from corexy_fmi.hil.loop import Gains
from corexy_fmi.hil.motions import with_approach
from corexy_fmi.hil.port import SerialPort
from corexy_fmi.hil.protocol import VERSION, Info, Status, Type
from corexy_fmi.hil.record import recording
from corexy_fmi.hil.segments import Plan, check
from corexy_fmi.hil.tracker import Tracker, open_lines
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording, write_recording

STOPPED = 3  # exit status: the motion did not come to its end
BOARDS = {  # both firmwares: what a dry run assumes, when no board is asked
    "stepper": Info(VERSION, "S", 64, 0, 32, 25_000, 16_000_000, (1 << 31) - 1),
    "dc": Info(VERSION, "D", 64, 0, 20, 1_000, 16_000_000, 40 << 20),
}
COUNTS = {"stepper": 3200, "dc": 4000}  # of a revolution: 16 microsteps; 1000 lines


class Dialect(StrEnum):
    """What the board speaks."""

    binary = "binary"
    grbl = "grbl"


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What the options of a run say."""

    machine: Machine
    port: str
    out: Path = Path()
    counts: int | None = None
    allowed: Allowed = field(default_factory=Allowed)
    tracker: str | None = None
    centred: bool = False
    arm: bool = False
    beside: bool = False
    supply: float = 24.0
    home: bool = False
    switches: Switches = field(default_factory=Switches)

    @property
    def counts_per_turn(self) -> int:
        """Steps or encoder counts of a motor revolution."""
        return COUNTS[self.machine.drive] if self.counts is None else self.counts


def execute(setup: Setup, order: Recording) -> Recording | None:
    """Plan, check, and with ``arm`` drive; the recording, or None for a dry run.

    Leaves with status 3 where the motion stopped early; its recording up to then is written.
    Raises InputError for what the machine or the board does not allow.
    """
    if setup.machine.drive == "dc" and setup.beside:
        raise InputError("--beside: it drives the FMU with angles, expected a stepper machine")
    if not setup.arm:
        _dry(setup, order)
        return None
    board, tracker = open_bench(setup)
    return drive_on(setup, board, order, tracker)


def open_bench(setup: Setup) -> tuple[Board, Tracker | None]:
    """The board at its port and the tracker, if there is one."""
    tracker = Tracker(open_lines(setup.tracker)) if setup.tracker else None
    return Board(SerialPort(setup.port)), tracker


def stand_ready(setup: Setup, board: Board) -> tuple[Scale, Limits, Status]:
    """The board connected and set, homed where the setup says so, its place known.

    Leaves with status 3 where homing failed.  Raises InputError for another board or an unknown
    place.
    """
    info = board.connect()
    if info.kind != BOARDS[setup.machine.drive].kind:
        raise InputError(
            f"machine {setup.machine.name!r}: drive {setup.machine.drive}, but the board has the "
            "other firmware: `make flash FIRMWARE=stepper` or `FIRMWARE=dc` writes the right one"
        )
    scale = Scale.of(info, setup.machine, setup.counts_per_turn)
    limits = Limits.of(setup.machine, scale, setup.allowed)
    homing = Homing.of(setup.machine, scale, limits, setup.switches) if setup.home else None
    board.configure(limits)
    if not scale.steps:
        board.command(Type.GAINS, Gains.of(setup.machine, scale, setup.supply).pack())
    if homing is not None:
        say("homing")
        trouble = home(board, homing)
        if trouble:
            typer.echo(f"{setup.port}: {trouble}", err=True)
            raise typer.Exit(STOPPED)
    return scale, limits, board.located(setup.centred and not setup.home)


def drive_on(
    setup: Setup,
    board: Board,
    order: Recording,
    tracker: Tracker | None,
) -> Recording | None:
    """Drive a board that is there; as `execute`.  The tracker begins anew."""
    if tracker is not None:
        tracker.samples.clear()
    scale, limits, status = stand_ready(setup, board)
    plan, begin = with_approach(order, scale, status.counts)
    check(plan, limits)
    lines = {**provenance(setup.machine, "board"), **_loop(setup.machine)}
    made, log = _drive(setup, board, plan, begin, tracker, lines)
    _tell(log, scale, setup)
    if log.trouble:
        raise typer.Exit(STOPPED)
    return made


def _loop(machine: Machine) -> dict[str, str]:
    """Metadata: the loop of a dc board, so that a replay closes it too."""
    loop = machine.controller
    if machine.drive != "dc" or loop is None:
        return {}
    return {"controller": loop.line}


def _dry(setup: Setup, order: Recording) -> None:
    """What would be done."""
    scale = Scale.of(BOARDS[setup.machine.drive], setup.machine, setup.counts_per_turn)
    limits = Limits.of(setup.machine, scale, setup.allowed)
    plan, begin = with_approach(order, scale, (0, 0))
    check(plan, limits)
    fastest = max(max(abs(s.rate1), abs(s.rate2)) for s in plan.segments)
    metres = fastest / (scale.one * scale.tick * scale.per_metre)
    say(
        f"dry run, nothing moves: {plan.time[-1]:.2f} s in {len(plan.segments)} segments, of these "
        f"{begin:.2f} s to the start; fastest belt {metres:.4g} m/s; within the stage and limits"
    )
    say("add --arm to move the motors, from the centre of the stage with --centred, or --home")


def _drive(
    setup: Setup, board: Board, plan: Plan, begin: float, tracker: Tracker | None,
    about: dict[str, str],
) -> tuple[Recording | None, Log]:  # fmt: skip
    """Drive, with the growing file and the FMU beside; the recording where there is one."""
    with ExitStack() as stack:
        live = stack.enter_context(LiveFile(part_of(setup.out), begin, about))
        beside = stack.enter_context(Beside(setup.machine)) if setup.beside else None
        screen = stack.enter_context(console(stderr=True).status("filling the board's queue"))

        def watch(drive: Drive) -> None:
            live(drive)
            difference = beside(drive) if beside else ""
            if drive.time > 0:
                screen.update(f"{drive.time:6.1f} s of {plan.time[-1]:.1f} s {difference}")

        log = Drive(board, plan, tracker, watch).run()
    try:
        made = recording(setup.out.name, log, board, tracker, begin, about)
    except InputError as error:
        say(str(error))
        return None, log
    if beside is not None:
        made = beside.compare(made)
    write_recording(made, setup.out)
    part_of(setup.out).unlink(missing_ok=True)
    say(f"recording: {setup.out}")
    return made, log


def _tell(log: Log, scale: Scale, setup: Setup) -> None:
    """How it went, where the carriage is, and what was too slow."""
    x, y = scale.place(log.counts)
    where = f"the carriage is at x = {x:.5f} m, y = {y:.5f} m"
    if not log.known:
        where = "the carriage's place is unknown: --home, or centre it by hand, then --centred"
    ended = "every commanded step counted" if scale.steps else "the encoders followed"
    said = f"stopped: {log.trouble}" if log.trouble else f"complete: {ended}"
    say(f"{said}; {where}")
    if log.trouble:
        typer.echo(f"{setup.port}: {log.trouble}", err=True)
    if log.frames_bad or log.sent_again:
        say(f"link: {log.frames_bad} frames spoiled, {log.sent_again} sent again")
    if log.buffered < AHEAD:
        say(f"warning: the board's queue fell to {1e3 * log.buffered:.0f} ms; this host pauses up "
            f"to {1e3 * log.pause:.0f} ms: close other programs, or expect underruns")  # fmt: skip
