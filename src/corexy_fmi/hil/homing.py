"""Homing: each axis to its limit switch, off it, slowly to it again; then the place is known.

The firmware does it (`firmware/home.c`); the host says how fast, how far at most, and where the
switches are.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.limits import Limits, Scale
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.hil.protocol import ADVICE, Flag, State, Status, Type
from corexy_fmi.machine.record import Machine
from corexy_fmi.motion import half_stage

_HOME = struct.Struct("<8i")
FOR_HOMING = b"\1"  # body of ARM: no known place is needed
SILENT = 1.0  # [s] without a report: the board is gone
MARGIN = 1.1  # of the stage, within which a switch must open
SLOWER, PULL_OFF = 0.1, 2e-3  # of the speed for the second approach; [m] off a switch
FASTEST = 0.05  # [m/s]


@dataclass(frozen=True)
class Switches:
    """Where the carriage stands when a switch opens [m]; its sign is the side; None: lower end.

    ``speed`` [m/s] of the carriage on its way to them.
    """

    x: float | None = None
    y: float | None = None
    speed: float = 0.02


@dataclass(frozen=True)
class Homing:
    """The firmware's numbers: rates, counts of a motor, places as a + b and a - b in counts."""

    seek: tuple[int, int]
    slow: int
    travel: tuple[int, int]
    pull: int
    place: tuple[int, int]

    @classmethod
    def of(cls, machine: Machine, scale: Scale, limits: Limits, switches: Switches) -> Homing:
        """From the machine's stage; raises InputError for switches off it or a speed too high."""
        if not 0 < switches.speed <= FASTEST:
            raise InputError(f"--home-speed: found {switches.speed!r} m/s, expected above 0 and at "
                             f"most {FASTEST}")  # fmt: skip
        halves = half_stage(machine)
        ends = [-half if at is None else at
                for at, half in zip((switches.x, switches.y), halves, strict=True)]  # fmt: skip
        for name, at, half in zip(("--at-x", "--at-y"), ends, halves, strict=True):
            if not PULL_OFF < abs(at) <= half + PULL_OFF:
                raise InputError(f"{name}: found {at!r} m, expected {PULL_OFF:g} to {half:g} m on "
                                 "either side: the switch at an end of the stage")  # fmt: skip
        fast = scale.rate(switches.speed)
        if fast > min(limits.rate, limits.jump):
            raise InputError(f"--home-speed: found {switches.speed!r} m/s, expected no more than "
                             "--max-speed and --max-jump")  # fmt: skip
        sides = [fast if at > 0 else -fast for at in ends]
        return cls(
            seek=(sides[0], sides[1]),
            slow=max(round(SLOWER * fast), 1),
            travel=tuple(round(MARGIN * 2 * half * scale.per_metre) for half in halves),  # type: ignore[arg-type]
            pull=max(round(PULL_OFF * scale.per_metre), 1),
            place=tuple(round(2 * at * scale.per_metre) for at in ends),  # type: ignore[arg-type]
        )

    def pack(self) -> bytes:
        """Body of HOME."""
        return _HOME.pack(*self.seek, self.slow, *self.travel, self.pull, *self.place)


def home(board: Board, homing: Homing) -> str:
    """Home a board that is configured; what went wrong, empty if the place is known now.

    Raises InputError where the board refuses.  KeyboardInterrupt stops it with a ramp.
    """
    try:
        board.command(Type.ARM, FOR_HOMING)
        board.command(Type.HOME, homing.pack())
        return _ended(_until_done(board))
    except LinkLostError as error:
        return f"link lost ({error}): the board stops by itself; plug it in again"
    except KeyboardInterrupt:
        board.request(Type.STOP)
        return "homing interrupted; the place is unknown"


def _until_done(board: Board) -> Status:
    """The first report in which it homes no more; raises InputError for silence or a reset."""
    restarts, heard = board.restarts, board.port.now()
    status = board.fresh_status()
    while status.state in (State.HOMING, State.STOPPING):
        board.keep_alive()
        board.poll()
        if board.status is not None and board.status is not status:
            status, heard = board.status, board.port.now()
        if board.restarts > restarts:
            raise InputError("board: reset while homing, expected a steady supply; home again")
        if board.port.now() - heard > SILENT:
            raise InputError("board: no reports; check power and cable, then `corexy hil check`")
    return status


def _ended(status: Status) -> str:
    if status.state is State.IDLE and status.flags & Flag.POSITION_KNOWN:
        return ""
    return ADVICE.get(status.fault, status.fault.name.lower())
