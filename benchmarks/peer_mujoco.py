"""The same stage in MuJoCo: ten slides, twelve springs as fixed tendons, dry friction as loss.

Motors are imposed by the force that their travel puts on the coordinates, known for all times, so
that the whole run is one call of `mujoco.rollout`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.exact_stage import Array
from benchmarks.peer_case import FREE, ROW, Case
from corexy_fmi.topology import FULL

MODEL = """<mujoco>
  <option timestep="{step!r}" integrator="{integrator}" gravity="0 0 0">
    <flag contact="disable"/>
  </option>
  <worldbody>{bodies}</worldbody>
  <tendon>{tendons}</tendon>
</mujoco>"""
BODY = """
    <body><joint name="{name}" type="slide" axis="1 0 0" damping="{damping!r}"
      frictionloss="{loss!r}" {friction}/>
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/></body>"""


@dataclass(frozen=True)
class Setting:
    """Micro-steps in a row, the integrator, and whether friction stops within a step."""

    count: int
    integrator: str
    stiff: bool

    def __str__(self) -> str:
        stiff = "solreffriction -1/h, solimpfriction 0.9999" if self.stiff else "default friction"
        return f"{1e6 * ROW / self.count:g} us, {self.integrator}, {stiff}"


def model_text(case: Case, setting: Setting) -> str:
    """The model as MJCF."""
    step = ROW / setting.count
    mass, viscous, coulomb, _, _ = (np.asarray(a).tolist() for a in case.terms())
    stiff = f'solreffriction="-0 {-1 / step!r}" solimpfriction="0.9999 0.9999 1e-3"'
    friction = stiff if setting.stiff else ""
    names = [FULL.coordinates[i] for i in FREE]
    bodies = "".join(
        BODY.format(name=n, damping=b, loss=f, friction=friction, mass=m)
        for n, m, b, f in zip(names, mass, viscous, coulomb, strict=True)
    )
    tendons = "".join(
        f'\n    <fixed name="s{n}" stiffness="{k!r}" springlength="0 0">'
        + "".join(f'<joint joint="{c}" coef="{w}"/>' for c, w in s.row.items() if c in names)
        + "</fixed>"
        for n, (s, k) in enumerate(zip(FULL.sections, case.stiffness.tolist(), strict=True))
    )
    return MODEL.format(step=step, integrator=setting.integrator, bodies=bodies, tendons=tendons)


def mujoco_run(case: Case, setting: Setting) -> Callable[[], Array]:
    """One trajectory, stepped in C."""
    import mujoco
    from mujoco import rollout

    mujoco.set_mju_user_warning(lambda message: None)  # else a file beside the process
    model = mujoco.MjModel.from_xml_string(model_text(case, setting))
    data, count, rows = mujoco.MjData(model), setting.count, len(case.travel) - 1
    data.qpos[:] = case.start()
    whole = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty(mujoco.mj_stateSize(model, whole))
    mujoco.mj_getState(model, data, start, whole)
    pull = -_travel(case, count) @ case.terms()[4].T
    place = len(start) - model.nq - model.nv - model.na  # time, and what a version puts before qpos

    def once() -> Array:
        state, _ = rollout.rollout(
            model, data, start[None], pull[None], nstep=rows * count,
            control_spec=mujoco.mjtState.mjSTATE_QFRC_APPLIED,
        )  # fmt: skip
        return np.vstack([case.start()[:2], state[0, count - 1 :: count, place : place + 2]])

    return once


def _travel(case: Case, count: int) -> Array:
    """Travel of the motors when each step begins, (steps, 2) [m]."""
    at = np.arange((len(case.travel) - 1) * count) / count
    rows = np.arange(len(case.travel))
    return np.column_stack([np.interp(at, rows, case.travel[:, m]) for m in (0, 1)])
