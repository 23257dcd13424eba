"""What the printed equations would do: small runs with SciPy, without the package's kernel.

Every stage is M q'' + D q' + F tanh(r q' / width) + K q = torque with some coordinates imposed; K
need not be symmetric, as the printed one is not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.errata_terms import IDLERS, printed_idler, printed_motor, with_rows
from benchmarks.exact_stage import matrices, section_stiffness
from corexy_fmi.corners import contour_error

Array = NDArray[np.float64]
Parameters = Mapping[str, float]
WIDTH, ROW, LOST = 2e-4, 1e-3, 0.1  # [m/s] where friction turns over, [s], [m] that end a run
SIDE = 0.03  # [m]


@dataclass(frozen=True, eq=False)
class Stage:
    """mass, viscous, coulomb, rim (n,): rim is 1 for x, y and r for pulleys; stiffness (n, n)."""

    mass: Array
    stiffness: Array
    viscous: Array
    coulomb: Array
    rim: Array
    imposed: Sequence[int] = (2, 3)
    torque: Array = field(default_factory=lambda: np.zeros(1))

    def run(self, q: Array, sides: Sequence[tuple[Sequence[float], float]]) -> tuple[Array, Array]:
        """Times and coordinates (rows, n) from rest at q; a side is imposed rates and a duration.

        Ends where |x| or |y| passes ``LOST``.
        """
        n = len(q)
        z, now, times, rows = np.concatenate([q, np.zeros(n)]), 0.0, [0.0], [q]
        for rates, duration in sides:
            z[n + np.array(self.imposed, dtype=int)] = rates
            at = np.append(np.arange(ROW, duration - ROW / 2, ROW), duration)
            done = solve_ivp(self._right, (0, duration), z, t_eval=at, **_SOLVER)
            times += (now + done.t).tolist()
            rows += list(done.y[:n].T)
            if done.status == 1:
                return np.append(times, now + done.t_events[0][0]), np.array([*rows, rows[-1]])
            z, now = done.y[:, -1].copy(), now + duration
        return np.array(times), np.array(rows)

    def _right(self, t: float, z: Array) -> Array:
        """Right-hand side; imposed coordinates keep their rates."""
        q, v = z[: len(self.mass)], z[len(self.mass) :]
        dry = self.coulomb * np.tanh(self.rim * v / WIDTH)
        rate = (self.torque - self.stiffness @ q - self.viscous * v - dry) / self.mass
        rate[list(self.imposed)] = 0.0
        return np.concatenate([v, rate])


def _lost(t: float, z: Array) -> float:
    return LOST - max(abs(z[0]), abs(z[1]))


_lost.terminal = True  # type: ignore[attr-defined]
_SOLVER: dict[str, Any] = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-9, "events": (_lost,)}


def full_stage(p: Parameters, rows: Mapping[int, object] | None = None, dry: bool = True) -> Stage:
    """12 coordinates, motors imposed; the rows of some pulleys as printed."""
    mass, _, viscous, coulomb = matrices(p)
    rim = np.array([1.0, 1.0, *[p["pulley_radius"]] * 10])
    return Stage(mass, with_rows(p, rows or {}), viscous, coulomb * dry, rim)


def reduced_stage(p: Parameters, carriage_coulomb: float) -> Stage:
    """4 coordinates by (13), (15), motors imposed, with f_1e [N] as given."""
    r, inertia, drag = p["pulley_radius"], p["pulley_inertia"], p["pulley_viscous_friction"]
    k1, k2, k3, k4, k5 = section_stiffness(p)
    k_e = k1 * k2 / (k1 + k2) + 1 / (1 / k1 + 1 / k3 + 1 / k4 + 1 / k5)
    rows = np.array([[1, 1, -r, 0], [1, -1, 0, -r]])
    big = p["bridge_mass"] + p["carriage_mass"] + 4 * p["pulley_mass"]
    mass = np.array([p["carriage_mass"] + 4 * inertia / r**2, big, 1.0, 1.0])
    viscous = [p["carriage_viscous_friction"] + 4 * drag / r**2, p["bridge_viscous_friction"], 0, 0]
    coulomb = [carriage_coulomb, p["bridge_coulomb_friction"], 0, 0]
    return Stage(
        mass, k_e * rows.T @ rows, np.array(viscous), np.array(coulomb), np.array([1, 1, r, r])
    )


def on_the_belt(p: Parameters, x: float, y: float, coordinates: int) -> Array:
    """Coordinates that obey (1) at x, y [m]."""
    turns = [x + y, x - y, -x, -x, x, x, x - y, x + y, x + y, x - y]
    return np.array([x, y, *(np.array(turns) / p["pulley_radius"])])[:coordinates]


def corner_errors(stage: Stage, p: Parameters, speed: float) -> list[float]:
    """Eq. (17) [mm] at the three corners of a square run at a speed [m/s]; NaN once it is lost."""
    points = SIDE * (np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]) - 0.5)
    ways = np.diff(points, axis=0) / SIDE
    rates = speed * np.column_stack([ways.sum(axis=1), ways[:, 0] - ways[:, 1]])
    rates /= p["pulley_radius"]
    side = SIDE / speed
    start = on_the_belt(p, *points[0], len(stage.mass))
    times, q = stage.run(start, [(r, side) for r in rates])
    found = []
    for i in (1, 2, 3):
        near = (times > (i - 0.5) * side) & (times < (i + 0.5) * side)
        whole = times[-1] > (i + 0.5) * side
        error = contour_error(q[near, :2], points[i], ways[i - 1], ways[i]) if whole else np.nan
        found.append(1e3 * float(error))
    return found


def travel_of_a_side(stage: Stage, p: Parameters, speed: float) -> tuple[float, float]:
    """x, y [mm] at the end of a move of 30 mm along x from rest at the centre."""
    rates = np.array([speed, speed]) / p["pulley_radius"]
    x, y = 1e3 * stage.run(np.zeros(12), [(rates, SIDE / speed)])[1][-1, :2]
    return float(x), float(y)


def rest_after_two_radians(stage: Stage, p: Parameters) -> float:
    """dx/d(r phi_1) where the stage has come to rest after motor 1 turned by 2 rad."""
    q = stage.run(np.zeros(12), [((2.0, 0.0), 1.0), ((0.0, 0.0), 3.0)])[1]
    return float(q[-1, 0] / (2.0 * p["pulley_radius"]))


def time_until_lost(stage: Stage, p: Parameters, speed: float) -> float:
    """When a straight move along x leaves a stage of 0.1 m [s]; infinite where it does not."""
    rates = np.array([speed, speed]) / p["pulley_radius"]
    times, _ = stage.run(np.zeros(12), [(rates, SIDE / speed)])
    return float(times[-1]) if times[-1] < SIDE / speed - 1e-6 else float("inf")


def bridge_after(p: Parameters, rows: Mapping[int, object], y: float, duration: float) -> float:
    """y [mm] a time [s] after the stage was let go at y [m] with slack-free belts, motors off."""
    bare = full_stage(p, rows, dry=False)
    free = Stage(bare.mass, bare.stiffness, bare.viscous, bare.coulomb, bare.rim, imposed=())
    q = free.run(on_the_belt(p, 0.0, y, 12), [((), duration)])[1]
    return 1e3 * float(q[-1, 1])


def turn_after(p: Parameters, heavy: Sequence[int], volts: float, duration: float) -> float:
    """phi_1 [rad] a time [s] after a voltage at motor 1 of the 4-DoF dc stage.

    Pulleys 8 and 9 are twenty times as heavy as the others; ``heavy`` are those that J_1e holds.
    """
    bare, ratio = reduced_stage(p, 0.0), {8: 20, 9: 20}
    inertia = [
        p["motor_inertia"] + sum(p["pulley_inertia"] * ratio.get(i, 1) for i in group)
        for group in (heavy, [i for i in range(7, 11) if i not in heavy])
    ]
    drag = 3 * p["pulley_viscous_friction"] + p["motor_damping_gain"]
    mass = np.array([*bare.mass[:2], *inertia])
    viscous = np.array([*bare.viscous[:2], drag, drag])
    torque = np.array([0, 0, p["motor_torque_gain"] * volts, 0])
    stage = Stage(mass, bare.stiffness, viscous, 0 * mass, bare.rim, (), torque)
    return float(stage.run(np.zeros(4), [((), duration)])[1][-1, 2])


def printed_rows(signs: tuple[int, int, int, int]) -> dict[int, object]:
    """All idler rows of (8) as reconstructed."""
    return {i: printed_idler(i, signs) for i in IDLERS}


def printed_motors() -> dict[int, object]:
    """Both rows of (10)."""
    return {i: printed_motor(i) for i in (1, 2)}
