"""What `corexy hil home` does on this project's firmware: shown first, then driven and told."""

from __future__ import annotations

from corexy_fmi.commands.hil_run import BOARDS, Dialect, Setup, open_bench, stand_ready
from corexy_fmi.commands.screen import say
from corexy_fmi.errors import InputError
from corexy_fmi.hil.homing import Homing, Switches
from corexy_fmi.hil.limits import Limits, Scale


def home_board(setup: Setup) -> None:
    """Home, where ``setup.arm`` says so; otherwise say what would be done.

    Leaves with status 3 where homing failed.  Raises InputError for what is not allowed.
    """
    if not setup.arm:
        _dry(setup)
        return
    board, _ = open_bench(setup)
    scale, _, status = stand_ready(setup, board)
    x, y = scale.place(status.counts)
    say(f"homed; the carriage is at x = {x:.5f} m, y = {y:.5f} m")


def _dry(setup: Setup) -> None:
    scale = Scale.of(BOARDS[setup.machine.drive], setup.machine, setup.counts_per_turn)
    limits = Limits.of(setup.machine, scale, setup.allowed)
    homing = Homing.of(setup.machine, scale, limits, setup.switches)
    ways = [
        f"{axis} towards {'+' if seek > 0 else '-'}{axis}, at most {travel / scale.per_metre:.3g} m"
        for axis, seek, travel in zip("xy", homing.seek, homing.travel, strict=True)
    ]
    say(f"dry run, nothing moves: first {ways[0]}, then {ways[1]}, "
        f"at {1e3 * setup.switches.speed:g} mm/s")  # fmt: skip
    say("add --arm to move the motors; be at the emergency stop, try each switch by hand before")


def check_switches(dialect: Dialect, switches: Switches) -> None:
    """A GRBL controller knows its own; raises InputError where others are told."""
    if dialect is Dialect.grbl and switches != Switches():
        raise InputError(
            "--at-x, --at-y, --home-speed: given with --dialect grbl, expected the "
            "controller's own settings $23 to $27, $130, $131"
        )
