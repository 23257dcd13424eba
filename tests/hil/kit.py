"""What the HIL tests share: a prepared board and a rectangle on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import Drive, Log, Watcher
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.motions import with_approach
from corexy_fmi.hil.protocol import SEGMENT, WORD, Cause, Status, Type
from corexy_fmi.hil.segments import Plan, Segment, check
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.emulator import TICK
from tests.hil.rig import STEPS, Rig, RigLines, yin

SHAPE = Rectangle(0.02, 0.014, 0.039)


@dataclass
class Bench:
    """A board at a rig with its limits set, and the plan of a rectangle."""

    rig: Rig
    board: Board
    scale: Scale
    limits: Limits
    plan: Plan
    begin: float
    tracker: Tracker

    def drive(self, watch: Watcher | None = None) -> Log:
        return Drive(self.board, self.plan, self.tracker, watch).run()


def bench(rig: Rig, shape: Rectangle = SHAPE, allowed: Allowed | None = None) -> Bench:
    """Connected, centred, configured; nothing moves yet."""
    machine = yin()
    board = Board(rig)
    scale = Scale.of(board.connect(), machine, STEPS)
    limits = Limits.of(machine, scale, allowed or Allowed())
    status = prepare(board, limits)
    order = command(shape.motion, scale.radius)
    plan, begin = with_approach(order, scale, status.counts)
    check(plan, limits)
    return Bench(rig, board, scale, limits, plan, begin, Tracker(RigLines(rig)))


def prepare(board: Board, limits: Limits, centred: bool = True) -> Status:
    """Limits set, and where it stands known."""
    board.configure(limits)
    return board.located(centred)


def step_ticks(plan: Plan, motor: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Tick and direction of every step that the firmware will emit, both (steps,)."""
    ticks, signs = [], []
    for segment, tick, start in zip(plan.segments, plan.ticks, plan.positions, strict=False):
        p = start[motor] + segment[1 + motor] * np.arange(segment.ticks + 1)
        moved = np.diff(p // plan.scale.one)
        where = np.flatnonzero(moved)
        ticks.append(tick + 1 + where)
        signs.append(moved[where])
    return np.concatenate(ticks), np.concatenate(signs)


def order_of(shape: Rectangle = SHAPE) -> Recording:
    """The command of a rectangle."""
    return command(shape.motion, yin().parameters["pulley_radius"])


def jitter(rig: Rig, log: Log) -> tuple[float, list[int]]:
    """Largest lateness [us] of a step against its tick, and how many steps each motor made.

    Fails where steps, directions or their number differ from the plan.
    """
    latest, made = 0.0, []
    for motor, bit in enumerate((2, 3)):
        cycles, signs = rig.rising(bit)
        ticks, wanted = step_ticks(log.plan, motor)
        assert len(cycles) == len(ticks), (len(cycles), len(ticks))
        assert np.array_equal(signs, wanted)
        late = cycles - TICK * (log.start + ticks)
        late -= late.min()
        latest = max(latest, float(late.max()) / 16)
        made.append(len(cycles))
    return latest, made


def give(board: Board, *segments: Segment, number: int = 0) -> Cause:
    """One frame of segments; what the board says to it."""
    board._replies.clear()
    board.send(Type.SEGMENTS, b"".join(SEGMENT.pack(*s) for s in segments), number)
    for _ in range(20):
        board.poll()
        if board._replies:
            return board._replies[-1].code
    raise AssertionError("no reply")


def start(board: Board) -> None:
    """RUN, half a thousand ticks ahead."""
    board.command(Type.RUN, WORD.pack(board.fresh_status().tick + 500))


def wait(board: Board, seconds: float, beat: bool = True) -> None:
    """Let emulated time pass [s]."""
    end = board.port.now() + seconds
    while board.port.now() < end:
        if beat:
            board.keep_alive()
        board.poll()
