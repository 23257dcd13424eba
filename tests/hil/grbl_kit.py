"""What the GRBL tests share: the stand-in behind a port with a clock of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from corexy_fmi.hil.grbl_drive import Drive, Log
from corexy_fmi.hil.grbl_link import Link
from corexy_fmi.hil.grbl_moves import Grid, Move, moves, program
from corexy_fmi.hil.grbl_timing import Timeline, timeline
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.grbl_motion import TICK
from tests.hil.grbl_stand_in import StandIn

RADIUS = load_machine("yin2018").parameters["pulley_radius"]
SHAPE = Rectangle(0.02, 0.014, 0.039)


@dataclass
class Wire:
    """A port whose time is the stand-in's; ``at`` calls a function once its time has come."""

    controller: StandIn
    at: list[tuple[float, Callable[[Wire], None]]] = field(default_factory=list)
    plugged: bool = True
    sent: bytearray = field(default_factory=bytearray)

    def read(self, wait: float) -> bytes:
        until = self.now() + max(wait, TICK)
        while self.now() < until:
            self._advance(TICK)
            if not self.plugged:
                raise LinkLostError("unplugged")
            if data := self.controller.read():
                return data
        return b""

    def _advance(self, seconds: float) -> None:
        self.controller.advance(seconds)
        while self.at and self.at[0][0] <= self.now():
            self.at.pop(0)[1](self)

    def write(self, data: bytes) -> None:
        if not self.plugged:
            raise LinkLostError("unplugged")
        self.sent += data
        self.controller.write(data)

    def now(self) -> float:
        return self.controller.time

    def reopen(self) -> bool:
        self._advance(0.05)
        return self.plugged

    def close(self) -> None: ...


@dataclass
class Bench:
    """A connected controller and a rectangle for it, from where it stands."""

    wire: Wire
    link: Link
    grid: Grid
    start: tuple[int, int]
    made: list[Move]
    lines: list[str]
    line: Timeline

    @property
    def controller(self) -> StandIn:
        return self.wire.controller

    def drive(self, **options: object) -> Log:
        return Drive(self.link, self.lines, **options).run()  # type: ignore[arg-type]

    def link_steps(self) -> tuple[int, int]:
        """Where it stands."""
        return self.grid.steps(self.link.locate())

    def wanted(self) -> np.ndarray:
        """Motor counts at the moves' ends (n, 2)."""
        x, y = np.array([move[1:] for move in self.made]).T
        return np.column_stack([x + y, x - y])


def order_of(shape: Rectangle = SHAPE) -> Recording:
    return command(shape.motion, RADIUS)


def bench(
    controller: StandIn | None = None, shape: Rectangle = SHAPE, feed: float | None = None
) -> Bench:
    """Connected; the rectangle's first corner is where the carriage stands."""
    wire = Wire(controller or StandIn())
    link = Link(wire)
    build = link.connect()
    here = link.locate()
    grid = Grid(link.settings[100], (0, 0))
    first = np.array(shape.vertices[0]) * 1e3 * grid.per_mm
    grid = Grid(grid.per_mm, tuple((np.array(grid.steps(here)) - np.rint(first)).astype(int)))
    start, made = moves(order_of(shape), RADIUS, grid)
    factor = build.feed_factor if feed is None else feed
    lines = ["G21G90G94", *program(start, made, grid, link.offset, factor), "G4P0.01"]
    line = timeline(start, made, grid, link.settings, build.blocks)
    return Bench(wire, link, grid, start, made, lines, line)
