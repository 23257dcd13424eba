"""One motion through MuJoCo: where the tip is, seen from the frame, at every row."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.mechanism.mjcf import Parts, model_text

Array = NDArray[np.float64]
ROW, COUNT = 1e-3, 20  # [s] between rows; steps in a row
INTEGRATOR = "implicitfast"  # tendons' damping is implicit too
BLOCK = 500  # rows that one call of MuJoCo steps through


def rest_state(p: Mapping[str, float], phi: Array) -> dict[str, float]:
    """Coordinates at which motor angles (2,) [rad] hold the stage without load, eq. (1)."""
    r = p["pulley_radius"]
    x, y = r * (phi[0] + phi[1]) / 2, r * (phi[0] - phi[1]) / 2
    turns = (-x, -x, x, x, x - y, x + y, x + y, x - y)
    idlers = {f"phi{3 + n}": t / r for n, t in enumerate(turns)}
    return {"x": x, "y": y, "phi1": phi[0], "phi2": phi[1], **idlers}


def accelerations(phi: Array, count: int) -> Array:
    """What drives the rotors (steps, 2) [rad/s^2] so that they turn linearly between rows."""
    rates = np.diff(phi, axis=0) / ROW
    out = np.zeros((len(rates), count, 2))
    out[:, 0] = np.diff(rates, axis=0, prepend=np.zeros((1, 2))) * count / ROW
    return out.reshape(-1, 2)


def mujoco_run(
    p: Mapping[str, float],
    phi: Array,
    parts: Parts | None = None,
    count: int = COUNT,
    integrator: str = INTEGRATOR,
) -> Array:
    """x, y (rows, 2) [m] of the tip under motor angles (rows, 2) [rad] at rows of 1 ms."""
    import mujoco
    from mujoco import rollout

    mujoco.set_mju_user_warning(lambda message: None)  # else a file beside the process
    text = model_text(p, parts or Parts(), ROW / count, integrator)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for name, value in rest_state(p, phi[0]).items():
        data.qpos[model.joint(name).qposadr[0]] = value
    whole = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, whole))
    mujoco.mj_getState(model, data, state, whole)
    drive, seen = accelerations(np.vstack([phi, phi[-1:]]), count), []
    for at in range(0, len(drive), BLOCK * count):
        states, sensed = rollout.rollout(
            model, data, state[None], drive[None, at : at + BLOCK * count]
        )
        state = states[0, -1].copy()
        seen.append(sensed[0, ::count, :2].copy())
    return np.concatenate(seen)
