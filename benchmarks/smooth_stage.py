"""The paper's 12-DoF stage with smoothed friction, for SciPy's solvers: the usual way to run it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.exact_stage import Side, matrices

Array = NDArray[np.float64]
MOTORS, FREE = [2, 3], [0, 1, *range(4, 12)]


class SmoothStage:
    """State: travel [m] and speed [m/s] of the ten free coordinates, idlers as r phi.

    Coulomb friction is f tanh(v / width); motors are imposed.
    """

    def __init__(self, parameters: Mapping[str, float], width: float) -> None:
        mass, k, viscous, coulomb = matrices(parameters)
        scale = np.where(np.arange(12) < 2, 1.0, 1.0 / parameters["pulley_radius"])
        inverse = 1.0 / (mass * scale**2)
        matrix = inverse[:, None] * k * scale[:, None] * scale
        self.k_free, self.k_motor = matrix[np.ix_(FREE, FREE)], matrix[np.ix_(FREE, MOTORS)]
        self.viscous = (inverse * viscous * scale**2)[FREE]
        self.coulomb = (inverse * coulomb * scale)[FREE]
        self.radius, self.width = parameters["pulley_radius"], width

    def derivative(self, start: Array, rate: Array, begin: float):  # type: ignore[no-untyped-def]
        """Right-hand side while the motors' belts move from start [m] at a rate [m/s]."""

        def right(t: float, z: Array) -> Array:
            q, v = z[:10], z[10:]
            pull = self.k_motor @ (start + rate * (t - begin))
            force = self.k_free @ q + self.viscous * v + self.coulomb * np.tanh(v / self.width)
            return np.concatenate([v, -force - pull])

        return right

    def jacobian(self, t: float, z: Array) -> Array:
        """Derivative of the right-hand side."""
        slope = (
            self.coulomb / self.width / np.cosh(np.minimum(np.abs(z[10:] / self.width), 300)) ** 2
        )
        damping = np.diag(self.viscous + slope)
        return np.block([[np.zeros((10, 10)), np.eye(10)], [-self.k_free, -damping]])

    def run(
        self, start: Array, sides: Sequence[Side], row: float, method: str, **options: Any
    ) -> Array:
        """x, y (n, 2) [m] at rows every ``row`` [s]; the solver restarts at each corner."""
        travel = np.array(start) * self.radius
        x, y = (travel[0] + travel[1]) / 2, (travel[0] - travel[1]) / 2
        z = np.concatenate([[x, y, -x, -x, x, x, x - y, x + y, x + y, x - y], np.zeros(10)])
        time, path = 0.0, [z[None, :2]]
        for rates, rows in sides:
            rate = np.array(rates) * self.radius
            times = time + row * np.arange(rows + 1)
            right = self.derivative(travel, rate, time)
            done = solve_ivp(right, times[[0, -1]], z, method, times, **options)
            path.append(done.y[:2, 1:].T)
            travel, time, z = travel + rate * rows * row, times[-1], done.y[:, -1]
        return np.concatenate(path)
