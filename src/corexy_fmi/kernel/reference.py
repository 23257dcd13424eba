"""The same step in plain Python: the independent check of the generated C, and slow (say so).

It runs the effects' own functions on floats, on tables it reads itself; nothing of the generator
or of the C sources is used.  Free-form laws, delays and closed loops are included.
"""

from __future__ import annotations

import math

import numpy as np

from corexy_fmi.kernel.layout import (
    COUNT,
    FIRST_KNOT,
    FREE_FORM_SIZE,
    KIND,
    LAW_KINDS,
    ONSET,
    VISCOUS,
    Layout,
)
from corexy_fmi.kernel.reference_damped import DampedIdlers, left_by_friction
from corexy_fmi.kernel.reference_sensor import Past, history
from corexy_fmi.kernel.reference_state import Array

EQUATION_1 = np.array([[0.5, 0.5], [0.5, -0.5]])  # x, y over the motors' travel


class ReferenceStage(DampedIdlers):
    """One lane of the stage, stepped."""

    def __init__(self, layout: Layout, vector: Array, fidelity: str, dc: bool) -> None:
        """``vector`` holds layout.parameters values."""
        super().__init__(layout, vector, fidelity, dc)
        self.past = Past(history(layout))

    def begin(self, time: float, angles: tuple[float, float], rest: Array) -> None:
        """At rest near eq. (1) of the angles, idlers in equilibrium; ``rest`` (6,): `REST`."""
        a = self.a
        self.time = self.now = self.begun = self.ramp_time = time
        self.ramp = (np.array(angles), np.zeros(2))
        self._command(time)
        a["q"][2:4] = a["command"]
        self.run_port("rotor")
        a["q"][2:4] = a["q"][2:4] + rest[4:]
        aside = a["q"][2:4] - a["command"]
        follow = np.array(self.stage.rest) * self.radius
        turn = self._settled(np.r_[follow @ rest[2:4], rest[2:4]], 0.0)[4:]
        held = -a["bound0"][4:] * np.clip(turn, -1.0, 1.0)
        balance = self._settled(np.zeros(2), held)[:2]
        a["q"][:2] = follow @ (np.array(angles) + aside) + balance + rest[:2]
        self._turn_along()
        a["q"][4:] = self._settled(a["q"][:4], held)[4:]
        self._travel()
        self.run_port("start")
        self.run_port("start_axis")
        if not self.stage.dynamic:
            self._place_kinematic()
        self._elongation()
        self.run_port("start_section")
        if self.stage.dynamic:
            self.tie()
        self._report()
        self.run_port("start_sensor")
        self._remember()

    def set_off(self, rates: Array) -> None:
        """Into even motion: motors at rates (2,) [rad/s], all else along."""
        follow = np.array(self.stage.rest) * self.radius
        self.a["v"] = self._settled(np.r_[follow @ rates, rates], 0.0)
        self.a["before"] = self.a["v"].copy()
        self._turn_along()

    def push(self, off: Array) -> None:
        """x, y, motors and their speeds off by (8,) [m, rad, m/s, rad/s], idlers along."""
        for states, way in ((("q",), off[:4]), (("v", "before"), off[4:])):
            along = self._settled(way, 0.0)
            for state in states:
                self.a[state] = self.a[state] + along
        self._turn_along()

    def _settled(self, ends: Array, torque: Array | float) -> Array:
        """All coordinates at rest under a torque [N m] on each idler, axes and motors at ``ends``.

        Two ends are the motors'; the axes settle then, too.
        """
        rows = self.stage.rows(self.radius)
        k = rows.T @ (self.a["stiffness0"][:, None] * rows)
        fixed = np.arange(4)[-len(ends) :]
        free = np.setdiff1d(np.arange(len(k)), fixed)
        q, load = np.zeros(len(k)), np.zeros(len(k))
        q[fixed], load[4:] = ends, torque
        if len(k) > 4:
            q[free] = np.linalg.solve(k[np.ix_(free, free)], load[free] - k[free][:, fixed] @ ends)
        return q

    def _command(self, time: float) -> None:
        angles, rates = self.ramp
        self.a["command"] = angles + rates * (time - self.ramp_time)
        self.a["command_rate"] = rates.copy()
        self.run_port("command")

    def _impose(self) -> None:
        a = self.a
        a["q"][2:4] = np.where(self.released, a["q"][2:4], a["command"])
        a["v"][2:4] = np.where(self.released, a["v"][2:4], a["command_rate"])

    def _turn_along(self) -> None:
        """Motors that are fixed to their axis."""
        for i in self.direct:
            for state in ("q", "v", "before"):
                self.a[state][2 + i] = self.a[state][i] / self.radius

    def _travel(self) -> None:
        a = self.a
        a["travel"], a["gain"] = self.radius * a["q"][2:], np.full(2, self.radius)
        self.run_port("transmission")

    def _elongation(self) -> None:
        a = self.a
        self._travel()
        a["elongation"] = self.row @ np.concatenate([a["q"][:2], a["travel"]])
        a["runout"], a["runout_slope"] = np.zeros(10), np.zeros(10)
        self.run_port("runout")
        idlers = np.abs(self.row[:, 4:])
        a["elongation"] += 0.5 * idlers @ a["runout"][2 : 2 + idlers.shape[1]]
        self.run_port("shape")

    def _contact(self) -> None:
        a, weights = self.a, self.row[:, 2:4]
        a["offset"] = np.zeros(2)
        a["pull"] = -weights.T @ (a["stiffness"] * a["elongation"])
        a["pull_stiffness"] = (weights**2).T @ a["stiffness"]
        self.run_port("contact")
        a["elongation"] = a["elongation"] + weights @ a["offset"]

    def _tension(self) -> None:
        a = self.a
        self.find_stiffness()
        self._contact()
        arm = np.concatenate([[1, 1], a["gain"], np.full(len(a["q"]) - 4, self.radius)])
        middle = self._middle_velocity()
        middle[2:4] = np.where(self.released, middle[2:4], a["v"][2:4])
        if self.tied:
            middle[4:] = self.turn_idlers(arm, middle)
        a["rate"] = self.row @ (arm * middle)
        a["tension"] = a["stiffness"] * (a["elongation"] + a["belt_time"] * a["rate"])
        lawless = -(self.row.T @ a["tension"] * arm)[4:]
        self.run_port("tension")
        a["force"] = -self.row.T @ a["tension"] * arm
        idlers = np.abs(self.row[:, 4:])
        a["force"][4:] -= (
            0.5 * a["runout_slope"][2 : 2 + idlers.shape[1]] * (idlers.T @ a["tension"])
        )
        if self.tied and self.hooked:
            self.turn_lawfully(arm, middle, a["force"][4:] - lawless)
        a["force"][:2] -= 0.5 * self.slopes.T @ (a["slope"] * a["elongation"] ** 2)

    def _torque(self) -> None:
        a = self.a
        a["torque"], a["rotor_damping"] = np.zeros(2), np.zeros(2)
        a["applied"] = a["voltage"].copy()
        self.run_port("motor")
        a["torque"] += self.nominal["motor_torque_gain"] * a["applied"] if self.dc else 0.0
        self.run_port("torque")
        a["force"][2:4] += a["torque"]

    def _free_forms(self, acts: str, to: str) -> None:
        """Add the laws that act so to an array: forces, or bounds of Coulomb friction."""
        q, v = self.a["q"], self.a["v"]
        sources = {"vx": v[0], "vy": v[1], "t": self.now}
        sources |= dict(zip(("x", "y", "phi1", "phi2"), q[:4], strict=True))
        for f in range(4):
            p = self.vector[self.layout.free_form + f * FREE_FORM_SIZE :][:FREE_FORM_SIZE]
            count, kind = int(p[COUNT]), LAW_KINDS[int(p[KIND])]
            if not count or kind[0] != acts:
                continue
            viscous, onset = p[VISCOUS], p[ONSET]
            knots, heights = np.split(p[FIRST_KNOT:], 2)
            x = sources[kind[1]] - (onset if kind[1] == "t" else 0.0)
            value = np.interp(x, knots[:count], heights[:count])
            self.a[to][f] += value
            if acts == "friction" and viscous:
                self.a["damping"][f] = max(self.a["damping"][f] + viscous * value, 0.0)

    def _middle_velocity(self) -> Array:
        """Velocity in the middle of the coming step; exactly 0 while it sticks."""
        moving = self.a["v"] != 0
        return np.where(moving, 1.5 * self.a["v"] - 0.5 * self.a["before"], 0.0)

    def _kick(self) -> None:
        a, h = self.a, self.step
        a["bound"], a["damping"] = a["bound0"].copy(), a["damping0"].copy()
        a["moving"], a["across"] = a["mass"].copy(), a["force"][1::-1].copy()
        a["middle_v"] = self._middle_velocity()
        self._free_forms("friction", "bound")
        self.run_port("guide")
        self.run_port("stick")
        a["damping"][2:4] += a["rotor_damping"]
        before, b = a["v"].copy(), 0.5 * h * a["damping"] / a["moving"]
        push = h / a["moving"] / (1 + b)
        free, c = (1 - b) / (1 + b) * a["v"] + push * a["force"], push * np.maximum(a["bound"], 0)
        a["v"] = left_by_friction(free, c, self.smoothing())
        if self.tied:
            a["v"][4:] = self.turned
        a["v"][2:4] = np.where(self.released, a["v"][2:4], a["command_rate"])
        a["before"] = before
        a["before"][2:4] = np.where(self.released, before[2:4], a["v"][2:4])
        a["acceleration"] = (a["v"] - before)[:2] / h
        a["yaw_torque"] = np.array([-0.5 * a["spacing"][0] * (a["yaw_arm"] @ a["tension"])])
        self.run_port("structure")

    def find_forces(self) -> Array:
        """Generalised forces [N, N m] of belts, motors and laws at the present q and v."""
        self._elongation()
        self._tension()
        self._torque()
        self._free_forms("force", "force")
        for i in self.direct:
            self.a["force"][i] += self.a["force"][2 + i] / self.radius
        return self.a["force"]

    def _move(self) -> None:
        self._command(self.now)
        self.a["q"] += 0.5 * self.step * self.a["v"]
        self._impose()
        self.find_forces()
        self._kick()
        self.a["q"] += 0.5 * self.step * self.a["v"]
        self._turn_along()

    def _follow(self, end: float) -> None:
        self._command(end)
        self._impose()
        a, old = self.a, self.a["offset"]
        self._place_kinematic()
        rates = a["gain"] * a["command_rate"] + (a["offset"] - old) / self.step
        a["v"][:2] = EQUATION_1 @ rates

    def _place_kinematic(self) -> None:
        a = self.a
        self._travel()
        a["offset"], a["pull"], a["pull_stiffness"] = np.zeros(2), np.zeros(2), np.full(2, 1e-300)
        self.run_port("contact")
        a["q"][:2] = EQUATION_1 @ (a["travel"][:2] + a["offset"])

    def _micro_step(self, end: float) -> None:
        self.now = 0.5 * (self.time + end) if self.stage.dynamic else end
        self.elapsed = self.now - self.begun
        if self.stage.dynamic:
            self._move()
        else:
            self._follow(end)
        self.time = end
        self._report()
        self.run_port("filter")
        self._remember()

    def advance(self, duration: float, limit: float) -> None:
        """Advance by a duration [s] in equal micro-steps of at most ``limit`` [s]."""
        start, count = self.time, max(math.ceil(duration / limit - 1e-9), 1)
        self.step = duration / count
        for n in range(1, count + 1):
            self._micro_step(start + duration if n == count else start + n * self.step)

    def _report(self) -> None:
        a = self.a
        a["reported"], a["reported_velocity"] = a["q"][:2].copy(), a["v"][:2].copy()
        a["reported_acceleration"] = a["acceleration"].copy()
        self.run_port("output")

    def _sense(self) -> Array:
        self._report()
        self.run_port("sensor")
        return np.concatenate([self.a["reported"], self.a["reported_acceleration"]])

    def _remember(self) -> None:
        self.past.keep(self.time, self._sense())

    def outputs(self) -> dict[str, float]:
        """x, y, vx, vy, ax, ay as reported, phi1, phi2, x_true, y_true and the voltages now."""
        a, seen = self.a, self._sense()
        a["lateness"][:] = 0.0
        self.run_port("sampling")
        if a["lateness"][0] > 0:
            seen = self.past.recall(self.time - a["lateness"][0], self.time, seen)
        names = ("x", "y", "ax", "ay", "vx", "vy", "phi1", "phi2", "x_true", "y_true", "V1", "V2")
        values = [*seen, *a["reported_velocity"], *a["q"][2:4], *a["q"][:2], *a["voltage"]]
        return dict(zip(names, map(float, values), strict=True))
