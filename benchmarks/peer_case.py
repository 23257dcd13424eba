"""The run that all peers make: one rectangle of one machine, its matrices, and its exact path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.exact_stage import Array, Side, command, exact_run, matrices, rectangle
from corexy_fmi.kernel.call import Excitation, step_limit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.simulate import machine_vector
from corexy_fmi.topology import FULL

WIDTH, HEIGHT, SPEED, ROW = 0.02, 0.01, 0.04, 1e-3  # [m], [m], [m/s], [s]
FREE, MOTORS = [0, 1, *range(4, 12)], [2, 3]


@dataclass(frozen=True)
class Case:
    """A rectangle run of a machine, full model, motors imposed.

    Coordinates of the peers are travels [m]: x, y and r phi of the eight idlers.
    """

    machine: Machine

    @classmethod
    def named(cls, name: str) -> Case:
        """The case of a bundled machine."""
        return cls(load_machine(name))

    @cached_property
    def path(self) -> tuple[Array, list[Side]]:
        """First angles [rad] and the sides of the run."""
        radius = self.machine.parameters["pulley_radius"]
        return rectangle(WIDTH, HEIGHT, SPEED, radius, ROW)

    @cached_property
    def drive(self) -> Excitation:
        """Motor angles [rad] at the rows."""
        time, angles = command(*self.path, ROW)
        return Excitation(time, *np.ascontiguousarray(angles.T))

    @cached_property
    def travel(self) -> Array:
        """Belt travel of the motors at the rows, (rows, 2) [m]."""
        radius = self.machine.parameters["pulley_radius"]
        return radius * np.column_stack([self.drive.input1, self.drive.input2])

    @cached_property
    def exact(self) -> Array:
        """x, y (rows, 2) [m] of the converged set-valued reference, exact between events."""
        return exact_run(self.machine.parameters, *self.path, ROW)[0]

    @cached_property
    def vector(self) -> Array:
        """The kernel's parameter vector."""
        return machine_vector(self.machine, bundled_layout())

    @property
    def count(self) -> int:
        """Micro-steps that the kernel takes in a row by itself."""
        limit = step_limit(bundled_layout(), self.vector)
        return int(np.ceil(ROW / limit - 1e-9))

    @property
    def seconds(self) -> float:
        """Simulated time [s]."""
        return float(self.drive.time[-1])

    @cached_property
    def stiffness(self) -> Array:
        """Of each section, (12,) [N/m]."""
        return np.array(FULL.constants(self.machine.parameters, 0.0).stiffness, dtype=float)

    @cached_property
    def rows(self) -> Array:
        """Elongation of each section for a unit of travel, (12, 12)."""
        return FULL.rows(1.0)

    def terms(self) -> tuple[Array, Array, Array, Array, Array]:
        """Mass, viscous, Coulomb (10,), stiffness (10, 10) and that towards the motors (10, 2)."""
        mass, _, viscous, coulomb = matrices(self.machine.parameters)
        arm = np.where(np.arange(12) < 2, 1.0, self.machine.parameters["pulley_radius"])
        k = self.rows.T @ (self.stiffness[:, None] * self.rows)
        scaled = (mass / arm**2, viscous / arm**2, coulomb / arm)
        return (*(a[FREE] for a in scaled), k[np.ix_(FREE, FREE)], k[np.ix_(FREE, MOTORS)])

    def start(self) -> Array:
        """Travels at rest, eq. (1), (10,) [m]."""
        first, second = self.travel[0]
        x, y = (first + second) / 2, (first - second) / 2
        return np.array([x, y, -x, -x, x, x, x - y, x + y, x + y, x - y])

    def kick(self, step: float) -> tuple[Array, Array, Array]:
        """What a step [s] keeps of a speed, gives a force, and takes by friction, (10,) each."""
        mass, viscous, coulomb, _, _ = self.terms()
        share = 1.0 / (1.0 + step * viscous / (2 * mass))
        keep, push = (1.0 - step * viscous / (2 * mass)) * share, step / mass * share
        return keep, push, push * coulomb

    def error(self, path: Array) -> float:
        """Largest distance of x or y from the exact path [um]."""
        return float(1e6 * np.abs(path - self.exact).max())
