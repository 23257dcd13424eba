"""Motion of the GRBL stand-in: sixteen-block planner, executed in small steps of time.

Written apart from the package's own forecast: no closed forms, speeds are integrated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

USABLE = 15  # blocks of the ring of 16
TICK = 5e-4  # [s] of integration
CREEP = 0.5  # [mm/s] so that the last micrometre has an end


@dataclass
class Block:
    """From one lattice point to another; motor way in mm, speeds along both motors in mm/s."""

    goal: tuple[int, int]  # x, y [steps]
    steps: tuple[int, int]  # of motor A, B
    length: float
    unit: tuple[float, float]
    nominal: float
    acceleration: float
    enter: float  # most at its beginning


@dataclass
class Motion:
    """Counts of both motors, the blocks ahead, the speed."""

    settings: dict[int, float]
    usable: int = USABLE
    counts: list[int] = field(default_factory=lambda: [0, 0])
    emitted: list[int] = field(default_factory=lambda: [0, 0])  # steps either way
    blocks: list[Block] = field(default_factory=list)
    vertices: list[tuple[float, int, int]] = field(default_factory=list)
    planned: tuple[int, int] = (0, 0)  # x, y [steps] at the end of the last block
    speed: float = 0.0
    running: bool = False
    holding: bool = False
    time: float = 0.0
    begun: float = 0.0  # when it last began to run, planned anew
    _done: float = 0.0  # [mm] of the first block
    _base: tuple[int, int] = (0, 0)
    _last: Block | None = None
    _ran: bool = False

    @property
    def xy(self) -> tuple[float, float]:
        """Machine position [mm]."""
        a, b = self.counts
        return (a + b) / 2 / self.settings[100], (a - b) / 2 / self.settings[101]

    def full(self) -> bool:
        return len(self.blocks) >= self.usable

    def place(self, x: int, y: int) -> None:
        """Counts by decree: homing, reset."""
        self.counts = [x + y, x - y]
        self.clear()

    def clear(self) -> None:
        """Forget what is planned; stand."""
        a, b = self.counts
        self.planned = (a + b) // 2, (a - b) // 2
        self.blocks, self._last, self._done = [], None, 0.0
        self.speed, self.running, self.holding = 0.0, False, False

    def add(self, x_mm: float, y_mm: float, rate: float, inverse: bool) -> None:
        """A line to a machine position; ``rate`` [mm/s] along both motors, or [1/s] if inverse."""
        goal = round(x_mm * self.settings[100]), round(y_mm * self.settings[101])
        dx, dy = goal[0] - self.planned[0], goal[1] - self.planned[1]
        steps = dx + dy, dx - dy
        way = [s / self.settings[100 + m] for m, s in enumerate(steps)]
        length = math.hypot(*way)
        if length == 0:
            return
        unit = way[0] / length, way[1] / length
        limit = self._limit(unit, 110) / 60
        nominal = min(rate * length if inverse else rate, limit)
        enter = self._junction(unit, nominal)
        block = Block(goal, steps, length, unit, nominal, self._limit(unit, 120), enter)
        if not self.blocks:
            self._begin()
        self.blocks.append(block)
        self._last, self.planned = block, goal

    def _limit(self, unit: tuple[float, float], number: int) -> float:
        return min(self.settings[number + m] / abs(u) for m, u in enumerate(unit) if u)

    def _junction(self, unit: tuple[float, float], nominal: float) -> float:
        if self._last is None or not self.blocks:
            return 0.0
        before = self._last.unit
        cosine = -(before[0] * unit[0] + before[1] * unit[1])
        ceiling = min(nominal, self._last.nominal)
        if cosine > 0.999999:
            return 0.0
        if cosine < -0.999999:
            return ceiling
        turn = unit[0] - before[0], unit[1] - before[1]
        size = math.hypot(*turn)
        half = math.sqrt((1 - cosine) / 2)
        most = self._limit((turn[0] / size, turn[1] / size), 120)
        return min(ceiling, math.sqrt(most * self.settings[11] * half / (1 - half)))

    def _begin(self) -> None:
        self._base = self.counts[0], self.counts[1]
        self._done = 0.0

    def advance(self, seconds: float) -> None:
        """Live on for a time."""
        for _ in range(round(seconds / TICK)):
            if self.running:
                if not self._ran:
                    self.begun = self.time
                self._tick()
            self._ran = self.running
            self.time += TICK

    def _tick(self) -> None:
        left = TICK
        while left > 1e-12 and self.blocks and self.running:
            block = self.blocks[0]
            goal = self._allowed(block, left)
            change = block.acceleration * left
            after = max(self.speed - change, min(self.speed + change, goal))
            way = max((self.speed + after) / 2 * left, 1e-9)
            rest = block.length - self._done
            if way < rest:
                self._done, self.speed, left = self._done + way, after, 0.0
            else:
                self.speed += (after - self.speed) * rest / way
                left *= 1 - rest / way
                self._finish(block)
            self._emit()
            if self.holding and self.speed <= 1e-6:
                self.speed, self.running = 0.0, False
        if not self.blocks:
            self.speed, self.running = 0.0, False

    def _allowed(self, block: Block, left: float) -> float:
        """The speed from which everything ahead can still be met."""
        if self.holding:
            return 0.0
        speed = 0.0
        for ahead in reversed(self.blocks[1:]):
            speed = min(ahead.enter, math.sqrt(speed**2 + 2 * ahead.acceleration * ahead.length))
        rest = max(block.length - self._done, 0.0)
        # so that after this step of time what is left suffices to brake to `speed`
        change = block.acceleration * left
        square = change**2 / 4 - change * self.speed + speed**2 + 2 * block.acceleration * rest
        return min(block.nominal, max(math.sqrt(max(square, 0.0)) - change / 2, CREEP))

    def _finish(self, block: Block) -> None:
        self._emit(1.0)
        self.vertices.append((self.time, self.counts[0], self.counts[1]))
        self.blocks.pop(0)
        self._begin()

    def _emit(self, share: float | None = None) -> None:
        """Steps up to the share of the first block that is done."""
        if not self.blocks:
            return
        block = self.blocks[0]
        share = self._done / block.length if share is None else share
        for m in (0, 1):
            way = block.steps[m] * share
            goal = self._base[m] + math.trunc(way + math.copysign(1e-9, way))
            self.emitted[m] += abs(goal - self.counts[m])
            self.counts[m] = goal
