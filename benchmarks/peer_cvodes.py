"""The stage with smoothed friction under CasADi's interface to CVODES, exact Jacobians included."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.exact_stage import Array
from benchmarks.peer_case import ROW, Case


def cvodes_run(case: Case, width: float, rtol: float) -> Callable[[], Array]:
    """One trajectory, restarted at corners; friction f tanh(v / width) [m/s]."""
    import casadi

    mass, viscous, coulomb, k, k_motor = case.terms()
    q, v = casadi.SX.sym("q", 10), casadi.SX.sym("v", 10)
    drive, t = casadi.SX.sym("drive", 4), casadi.SX.sym("t")
    pull = k_motor @ (drive[:2] + t * drive[2:])
    force = -(k @ q) - pull - viscous * v - coulomb * casadi.tanh(v / width)
    dae = {"x": casadi.vertcat(q, v), "p": drive, "t": t, "ode": casadi.vertcat(v, force / mass)}
    options = {"reltol": rtol, "abstol": 1e-3 * rtol, "max_num_steps": 1_000_000}
    radius = case.machine.parameters["pulley_radius"]
    sides, first = [], case.travel[0]
    for rates, rows in case.path[1]:
        grid = (ROW * np.arange(1, rows + 1)).tolist()
        speed = radius * np.array(rates)
        made = casadi.integrator("side", "cvodes", dae, 0.0, grid, options)
        sides.append((made, np.concatenate([first, speed])))
        first = first + speed * rows * ROW

    def once() -> Array:
        state, path = np.concatenate([case.start(), np.zeros(10)]), [case.start()[None, :2]]
        for made, given in sides:
            found = np.asarray(made(x0=state, p=given)["xf"])
            path.append(found[:2].T)
            state = found[:, -1]
        return np.concatenate(path)

    return once
