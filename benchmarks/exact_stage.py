"""An independent solver of the paper's 12-DoF stage: exact between events, no kernel, no tables.

Mass and stiffness come from Lagrange's equations of (4) and (6), derived here with SymPy.  Between
two events (a coordinate stops or breaks away) the stage is linear, so a matrix exponential carries
it exactly; events are located by root finding on the Taylor series of the solution.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from math import factorial
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

Array = NDArray[np.float64]
Side = tuple[Sequence[float], int]  # motor rates [rad/s], number of rows
STEP, TERMS = 2.0e-5, 12  # [s] between looks for events; terms of the series within one


@cache
def lagrange() -> tuple[Any, Any]:
    """Mass and stiffness matrices of (4) and (6) as functions of the parameters."""
    q = sympy.symbols("x y phi1:11", real=True)
    x, y, phi = q[0], q[1], dict(enumerate(q[2:], 1))
    r, m_x, big_m, j_m, j_p = sympy.symbols("r m_x M J_m J_p", positive=True)
    k1, k2, k3, k4, k5 = k = sympy.symbols("k1:6", positive=True)
    v = (
        k1 * ((r * phi[3] + x) ** 2 + (r * phi[4] + x) ** 2)
        + k1 * ((r * phi[6] - x) ** 2 + (r * phi[5] - x) ** 2)
        + k2 * ((r * phi[3] + r * phi[1] - y) ** 2 + (r * phi[4] + r * phi[2] + y) ** 2)
        + k3 * ((r * phi[9] - r * phi[1]) ** 2 + (r * phi[10] - r * phi[2]) ** 2)
        + k4 * ((r * phi[9] - r * phi[8]) ** 2 + (r * phi[10] - r * phi[7]) ** 2)
        + k5 * ((r * phi[8] - r * phi[6] - y) ** 2 + (r * phi[7] - r * phi[5] + y) ** 2)
    ) / 2
    mass = sympy.diag(m_x, big_m, j_m, j_m, *[j_p] * 8)
    stiffness = sympy.hessian(v, q)
    symbols = (r, m_x, big_m, j_m, j_p, *k)
    return sympy.lambdify(symbols, (mass, stiffness)), (q, v, symbols)


def section_stiffness(p: Mapping[str, Any]) -> list[Any]:
    """k_1 .. k_5 [N/m] at the centre (PHYSICS 3)."""
    w, h, c = p["bridge_pulley_spacing"], p["motor_idler_span"], p["clip_spacing"]
    return [p["belt_axial_stiffness"] / length for length in ((w - c) / 2, h / 2, h, w, h / 2)]


def matrices(p: Mapping[str, float]) -> tuple[Array, Array, Array, Array]:
    """Mass (12,), stiffness (12, 12), viscous (12,) and Coulomb (12,) of a stepper machine."""
    big_m = p["bridge_mass"] + p["carriage_mass"] + 4 * p["pulley_mass"]
    masses = (p["carriage_mass"], big_m, p["motor_inertia"], p["pulley_inertia"])
    mass, stiffness = lagrange()[0](p["pulley_radius"], *masses, *section_stiffness(p))
    axes = ("carriage", "bridge")
    viscous = [p[f"{a}_viscous_friction"] for a in axes] + [p["pulley_viscous_friction"]] * 10
    coulomb = [p[f"{a}_coulomb_friction"] for a in axes] + [p["pulley_coulomb_friction"]] * 10
    return np.diag(mass).astype(float), np.array(stiffness), np.array(viscous), np.array(coulomb)


class ExactStage:
    """The stage with imposed motors; ``state``: q and v of ten free coordinates, phi1, phi2, 1."""

    def __init__(self, parameters: Mapping[str, float], angles: Array) -> None:
        self.mass, self.k, self.viscous, self.coulomb = matrices(parameters)
        self.free = np.array([0, 1, *range(4, 12)])
        self.k_free = self.k[np.ix_(self.free, self.free)]
        self.k_motor = self.k[np.ix_(self.free, np.array([2, 3]))]
        self.grip = self.coulomb[self.free]
        r, n = parameters["pulley_radius"], len(self.free)
        a, b = angles
        travel = np.array([a + b, a - b]) * r / 2
        x, y = travel
        pulleys = np.array([-x, -x, x, x, x - y, x + y, x + y, x - y]) / r
        self.state = np.concatenate([travel, pulleys, np.zeros(n), angles, [1.0]])
        self.slide = np.zeros(n)  # -1, 0 (stuck) or +1
        self.rate = np.zeros(2)
        self.events = 0
        self._maps: dict[tuple[bytes, bytes], tuple[Array, Array]] = {}

    def force(self, state: Array) -> Array:
        """Belt force on the free coordinates."""
        n = len(self.free)
        return -self.k_free @ state[:n] - self.k_motor @ state[2 * n : 2 * n + 2]

    def _matrix(self) -> Array:
        n = len(self.free)
        a, moving = np.zeros((2 * n + 3, 2 * n + 3)), self.slide != 0
        inverse = np.where(moving, 1 / self.mass[self.free], 0.0)
        a[:n, n : 2 * n] = np.diag(moving.astype(float))
        a[n : 2 * n, :n] = -inverse[:, None] * self.k_free
        a[n : 2 * n, n : 2 * n] = -np.diag(inverse * self.viscous[self.free])
        a[n : 2 * n, 2 * n : 2 * n + 2] = -inverse[:, None] * self.k_motor
        a[n : 2 * n, -1] = -inverse * self.slide * self.grip
        a[2 * n : 2 * n + 2, -1] = self.rate
        return a

    def _map(self) -> tuple[Array, Array]:
        key = (self.slide.tobytes(), self.rate.tobytes())
        if key not in self._maps:
            a = self._matrix()
            self._maps[key] = a, expm(a * STEP)
        return self._maps[key]

    def _margins(self, state: Array) -> Array:
        """Positive while a coordinate goes on as it does: speed along its slide, or spare grip."""
        n = len(self.free)
        speed = self.slide * state[n : 2 * n]
        spare = self.grip - np.abs(self.force(state))
        return np.where(self.slide != 0, speed, spare)

    def _settle(self, fresh: Sequence[int]) -> None:
        """Change the slide of coordinates whose margin ended: stop, break away or turn."""
        n, force = len(self.free), self.force(self.state)
        for i in fresh:
            held = abs(force[i]) <= self.grip[i]
            self.state[n + i] = 0.0
            self.slide[i] = 0.0 if held and self.slide[i] != 0 else np.sign(force[i])
        self.events += len(fresh)

    def advance(self, duration: float) -> None:
        """Carry the state over a duration [s] at the present motor rates."""
        left = duration
        while left > 1e-12:
            a, whole = self._map()
            h = STEP if left > STEP * (1 - 1e-9) else left
            end = whole @ self.state if h == STEP else expm(a * h) @ self.state
            ended = np.flatnonzero(self._margins(end) < 0)
            if len(ended):
                h, first = self._first(a, h, ended)
                self._settle(first)
            else:
                self.state = end
            left -= h

    def _first(self, a: Array, h: float, ended: NDArray[np.int_]) -> tuple[float, list[int]]:
        """Go to the first event before h; returns its time and the coordinates that it concerns."""
        terms = [self.state]
        for _ in range(TERMS):
            terms.append(a @ terms[-1])
        series = np.array([t / factorial(k) for k, t in enumerate(terms)])

        def at(tau: float) -> Array:
            return (tau ** np.arange(TERMS + 1)) @ series

        times: dict[int, float] = {}
        for i in ended:
            margin = lambda tau, i=i: self._margins(at(tau))[i]  # noqa: E731
            start = next((s for s in (0.0, 1e-3 * h, 1e-2 * h, 0.1 * h) if margin(s) > 0), None)
            times[i] = 0.0 if start is None else brentq(margin, start, h, xtol=1e-18)
        when = min(times.values())
        self.state = at(when)
        return when, [i for i, t in times.items() if t <= when + 1e-12]


def exact_run(
    parameters: Mapping[str, float], start: Array, sides: Sequence[Side], row: float
) -> tuple[Array, ExactStage]:
    """x, y (n, 2) [m] and the stage at its end; rows every ``row`` [s].

    ``start`` [rad] are the first angles, ``sides`` pairs of motor rates (2,) [rad/s] and a number
    of rows.  Angles are set anew at each row, so that rounding does not add up.
    """
    stage = ExactStage(parameters, start)
    angles, path = np.array(start, dtype=float), [stage.state[:2].copy()]
    for rates, rows in sides:
        stage.rate = np.array(rates, dtype=float)
        for n in range(1, rows + 1):
            stage.advance(row)
            stage.state[-3:-1] = angles + n * row * stage.rate
            path.append(stage.state[:2].copy())
        angles = angles + rows * row * stage.rate
    return np.array(path), stage


def rectangle(
    width: float, height: float, speed: float, radius: float, row: float, rest: float = 0.1
) -> tuple[Array, list[Side]]:
    """First angles [rad] and sides of a rectangle run [m, m/s], corners on rows."""
    sides: list[Side] = []
    for dx, dy, length in ((1, 0, width), (0, 1, height), (-1, 0, width), (0, -1, height)):
        rates = (speed * (dx + dy) / radius, speed * (dx - dy) / radius)
        sides.append((rates, round(length / speed / row)))
    sides.append(((0.0, 0.0), round(rest / row)))
    return np.array([-width - height, height - width]) / (2 * radius), sides


def command(start: Array, sides: Sequence[Side], row: float) -> tuple[Array, Array]:
    """Times (n,) [s] and motor angles (n, 2) [rad] of a run at its rows."""
    angles = [np.array(start, dtype=float)]
    for rates, rows in sides:
        corner = angles[-1]
        angles += [corner + n * row * np.array(rates) for n in range(1, rows + 1)]
    return row * np.arange(float(len(angles))), np.array(angles)
