"""Limits that the firmware enforces, from the machine file and the speeds that are allowed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.hil.protocol import CONFIG, Info
from corexy_fmi.machine.record import Machine
from corexy_fmi.motion import half_stage

REPORT = 10  # [ms]


@dataclass(frozen=True)
class Allowed:
    """What a motor's belt may do: speed [m/s], acceleration [m/s^2], jump of speed [m/s]; and for
    how long the host may be silent, at most 60 [s], before the board stops.
    """

    speed: float = 0.2
    acceleration: float = 20.0
    jump: float = 0.05
    silence: float = 0.2


@dataclass(frozen=True)
class Scale:
    """Motor angles in the board's integers.

    ``counts`` per revolution; ``one`` is one count as an integer position; ``radius`` [m] of the
    pulley; ``tick`` [s]; ``steps`` where counts are steps and not those of an encoder; ``fastest``
    is the largest integer position per tick that the firmware plays.
    """

    counts: int
    one: int
    radius: float
    tick: float
    steps: bool = True
    fastest: int = (1 << 31) - 1

    @classmethod
    def of(cls, info: Info, machine: Machine, counts: int) -> Scale:
        """The scale of a board on a machine with so many counts per revolution."""
        if counts < 1:
            raise InputError(f"counts per revolution: found {counts}, expected at least 1")
        radius = machine.parameters["pulley_radius"]
        one, steps = 1 << info.fraction_bits, info.kind == "S"
        return cls(counts, one, radius, 1 / info.tick_hz, steps, info.fastest)

    @property
    def per_metre(self) -> float:
        """Counts for a metre of belt."""
        return self.counts / (2 * np.pi * self.radius)

    def rate(self, speed: float) -> int:
        """A belt speed [m/s] as integer position per tick."""
        return round(speed * self.per_metre * self.tick * self.one)

    def angle(self, counts: float) -> float:
        """Counts as a motor angle [rad]."""
        return counts * 2 * np.pi / self.counts

    def place(self, counts: tuple[int, int]) -> tuple[float, float]:
        """Where the carriage stands by its counts, eq. (1) [m]."""
        return self.point(self.angle(counts[0]), self.angle(counts[1]))

    def point(self, phi1: float, phi2: float) -> tuple[float, float]:
        """Where motor angles [rad] place the carriage, eq. (1) [m]."""
        return self.radius * (phi1 + phi2) / 2, self.radius * (phi1 - phi2) / 2


@dataclass(frozen=True)
class Limits:
    """The firmware's numbers: a + b and a - b in counts, rates as integer positions per tick."""

    x: int
    y: int
    rate: int
    jump: int
    acceleration: int
    brake: int
    watchdog: int = 200  # [ms]

    @classmethod
    def of(cls, machine: Machine, scale: Scale, allowed: Allowed) -> Limits:
        """From the machine and what is allowed; raises InputError for what no board does."""
        for name, value in vars(allowed).items():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name}: found {value!r}, expected a positive number")
        if allowed.silence > 60:
            raise InputError(f"silence: found {allowed.silence!r} s, expected at most 60")
        # floor(P) of a motion that ends exactly on the edge may lie one count beyond
        reach = [int(2 * half * scale.per_metre) + 1 for half in half_stage(machine)]
        per_tick = scale.rate(allowed.acceleration * scale.tick)
        ceiling = (1 << 31) - 1
        return cls(
            x=reach[0],
            y=reach[1],
            rate=min(scale.rate(allowed.speed), scale.fastest),
            jump=min(scale.rate(allowed.jump), ceiling),
            acceleration=per_tick,
            brake=max(scale.rate(allowed.acceleration * 1e-3), 1),
            watchdog=max(round(1e3 * allowed.silence), 1),
        )

    def pack(self, report: int = REPORT) -> bytes:
        """Body of CONFIG; times in ms."""
        return CONFIG.pack(
            -self.x, self.x, -self.y, self.y, self.rate, self.jump, self.acceleration, self.brake,
            self.watchdog, report,
        )  # fmt: skip
