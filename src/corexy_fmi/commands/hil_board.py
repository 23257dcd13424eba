"""``corexy hil check``, ``monitor``, ``release`` and ``home``: what needs no motion to drive."""

from __future__ import annotations

from typing import Annotated

import typer

from corexy_fmi.commands.hil_grbl_watch import (
    home_controller,
    release_controller,
    show_controller,
    show_reports,
)
from corexy_fmi.commands.hil_home import check_switches, home_board
from corexy_fmi.commands.hil_options import (
    AccelOption,
    ArmOption,
    AtXOption,
    AtYOption,
    CountsOption,
    DialectOption,
    HomeSpeedOption,
    JumpOption,
    PortOption,
    SilenceOption,
    SpeedOption,
    SupplyOption,
)
from corexy_fmi.commands.hil_run import Dialect, Setup
from corexy_fmi.commands.hil_watch import show_link, show_live
from corexy_fmi.commands.screen import ASSUMED, MachineOption, label, say
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.homing import Switches
from corexy_fmi.hil.limits import Allowed
from corexy_fmi.hil.port import SerialPort
from corexy_fmi.hil.protocol import Type
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import check_kind


def _connected(port: str) -> Board:
    """The board at a port, asked who it is."""
    board = Board(SerialPort(port))
    board.connect()
    return board


def check(
    port: PortOption,
    seconds: Annotated[float, typer.Option(min=0.5, help="How long to listen.")] = 3.0,
    dialect: DialectOption = Dialect.binary,
) -> None:
    """Firmware, switches, link quality, latency and clock of the board; moves nothing.

    Examples:

    corexy hil check --port /dev/ttyUSB0
    """
    if dialect is Dialect.grbl:
        show_controller(port, seconds)
        return
    show_link(_connected(port), seconds)


def monitor(
    port: PortOption,
    seconds: Annotated[float | None, typer.Option(help="Without: until Ctrl-C.")] = None,
    dialect: DialectOption = Dialect.binary,
) -> None:
    """A live view of the board's reports; moves nothing.

    Examples:

    corexy hil monitor --port /dev/ttyUSB0
    """
    if dialect is Dialect.grbl:
        show_reports(port, seconds)
        return
    show_live(_connected(port), seconds)


def release(port: PortOption, dialect: DialectOption = Dialect.binary) -> None:
    """Switch the drivers off, to move the carriage by hand; the position is then unknown.

    Examples:

    corexy hil release --port /dev/ttyUSB0
    """
    if dialect is Dialect.grbl:
        release_controller(port)
    else:
        _connected(port).command(Type.RELEASE)
    say("drivers off")


def home(
    port: PortOption,
    machine: MachineOption = ASSUMED,
    arm: ArmOption = False,
    at_x: AtXOption = None,
    at_y: AtYOption = None,
    home_speed: HomeSpeedOption = Switches.speed,
    counts: CountsOption = None,
    supply: SupplyOption = 24.0,
    max_speed: SpeedOption = Allowed.speed,
    max_accel: AccelOption = Allowed.acceleration,
    max_jump: JumpOption = Allowed.jump,
    watchdog: SilenceOption = Allowed.silence,
    dialect: DialectOption = Dialect.binary,
) -> None:
    """Each axis to its limit switch, off it, slowly to it again; says where the carriage stands.

    A board that resets when its port is opened forgets it again: use --home of a run instead. On a
    GRBL controller it is $H, and the controller's own settings count.

    Examples:

    corexy hil home --port /dev/ttyUSB0

    corexy hil home --port /dev/ttyUSB0 --at-x -0.085 --at-y -0.14 --arm
    """
    switches = Switches(at_x, at_y, home_speed)
    check_switches(dialect, switches)
    if dialect is Dialect.grbl:
        home_controller(port, arm)
        return
    chosen = check_kind(load_machine(machine))
    label(chosen)
    allowed = Allowed(max_speed, max_accel, max_jump, watchdog)
    setup = Setup(
        machine=chosen, counts=counts, allowed=allowed, port=port, arm=arm, supply=supply,
        home=True, switches=switches,
    )  # fmt: skip
    home_board(setup)
