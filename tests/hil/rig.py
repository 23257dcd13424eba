"""The whole loop in lock-step: host code, firmware on the emulated board, FMU, tracker."""

from __future__ import annotations

import atexit
import tempfile
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Protocol

import numpy as np

from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import parameter_values
from corexy_fmi.fmu.session import Session, unpacked
from corexy_fmi.machine import Machine, load_machine
from tests.hil.emulator import FREQUENCY, Emulator

STEPS = 3200
SLICE = 1e-3  # [s] of emulation between two looks of the host
Spoil = Callable[[bytes], bytes]


@cache
def fmu() -> Path:
    """The FMU of the bare machine."""
    folder = tempfile.TemporaryDirectory(prefix="corexy-hil-fmu-")
    atexit.register(folder.cleanup)
    return build_fmu(Path(folder.name))


class Stage:
    """The FMU, moved by step counts; each step of time is a ramp between two counts."""

    def __init__(self, machine: Machine | None = None) -> None:
        self._stack = ExitStack()
        values = {} if machine is None else parameter_values(machine)
        place = self._stack.enter_context(unpacked(fmu()))
        self._session = self._stack.enter_context(Session(fmu(), place))
        self._session.start(0.0, {"phi1": 0.0, "phi2": 0.0}, values)
        self._set = self._session.setter(("phi1", "phi2"))
        self._get = self._session.getter(("x", "y"))
        self._steps, self.time = 0, 0.0
        self._phi = np.zeros(2)
        self.x = self.y = 0.0

    def move(self, counts: tuple[int, int]) -> None:
        """One slice, in which the motors go to these counts."""
        phi = np.array(counts) * 2 * np.pi / STEPS
        self._set.values[:] = self._phi.tolist()
        self._set.apply()
        self._set.rates[:] = ((phi - self._phi) / SLICE).tolist()
        self._set.apply_rates()
        self._session.step(self.time, SLICE)
        self._steps += 1
        self.time, self._phi = self._steps * SLICE, phi
        self.x, self.y = self._get.read()

    def close(self) -> None:
        self._stack.close()


class Placed(Protocol):
    """Something at x, y [m]."""

    x: float
    y: float


class Rig:
    """A port whose other end is the emulated board: reading it lets emulated time pass.

    ``to_board``, ``to_host`` spoil bytes on the way; ``events`` are calls at emulated times [s].
    """

    def __init__(self, stage: Stage | None = None, tracker_rate: float = 1000.0) -> None:
        self.emulator = Emulator()
        self.stage = stage
        self.edges: list[np.ndarray] = []
        self.counts = (0, 0)
        self.to_board: Spoil = lambda data: data
        self.to_host: Spoil = lambda data: data
        self.events: list[tuple[float, Callable[[], None]]] = []
        self.lines: deque[tuple[float, bytes]] = deque()
        self.truth: list[tuple[float, float, float]] = []
        self._every = round(1 / tracker_rate / SLICE)
        self._slices = 0
        self.revive: Callable[[], None] = lambda: None
        self.noise = np.random.default_rng(0), 0.0  # [m] of the tracker
        self.host_delay = 0.0  # [s] by which the tracker's lines come late

    def read(self, wait: float) -> bytes:
        """One slice passes."""
        self._slices += 1
        for event in [e for e in self.events if e[0] <= self.now()]:
            self.events.remove(event)
            event[1]()
        ran = self.emulator.run_to(round(self._slices * SLICE * FREQUENCY))
        self.counts = ran.counts
        if len(ran.edges):
            self.edges.append(ran.edges)
        if self.stage is not None:
            self.stage.move(ran.counts)
            if self._slices % self._every == 0:
                self._sample(self.stage)
        return self.to_host(ran.data)

    def _sample(self, stage: Placed) -> None:
        now = self.now()
        self.truth.append((now, stage.x, stage.y))
        rng, size = self.noise
        x, y = np.array([stage.x, stage.y]) + size * rng.standard_normal(2)
        text = f"{now + 1234.5!r} {float(x)!r} {float(y)!r}\n".encode()
        self.lines.append((now + self.host_delay, text))

    def write(self, data: bytes) -> None:
        self.emulator.write(self.to_board(data))

    def now(self) -> float:
        return self._slices * SLICE

    def reopen(self) -> bool:
        return True

    def close(self) -> None:
        self.emulator.close()
        if self.stage is not None:
            self.stage.close()

    def __enter__(self) -> Rig:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def rising(self, bit: int) -> tuple[np.ndarray, np.ndarray]:
        """Cycle of each step of the pin PD``bit``, and its direction."""
        edges = np.concatenate(self.edges)
        mine = edges[(edges["port"] == ord("D")) & (edges["bit"] == bit) & (edges["level"] == 1)]
        return mine["cycle"].astype(np.int64), np.diff(mine["count"], prepend=0)


class RigLines:
    """The tracker of a rig: lines that have come by now."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def read(self) -> bytes:
        data = b""
        while self._rig.lines and self._rig.lines[0][0] <= self._rig.now():
            data += self._rig.lines.popleft()[1]
        return data


def yin() -> Machine:
    """The stepper machine of the paper."""
    return load_machine("yin2018")
