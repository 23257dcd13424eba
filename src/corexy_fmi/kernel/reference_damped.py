"""Idlers between damped belts in plain Python, as `damped_code.py` writes them in C."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from corexy_fmi.kernel.reference_state import Array, ReferenceState
from corexy_fmi.kernel.steps import STEP_CALM, STEP_LONGEST, STEP_RESOLUTION, TIED

ROUNDED = ((0.0, 1.0), (0.194, 0.596), (0.667, 0.1546))  # lines of smooth Coulomb friction


class Poles(NamedTuple):
    """What bounds a micro-step: a squared frequency [1/s^2], rates [1/s], the longest step [s].

    ``damped`` are the belts' rates, ``of_axes`` those of axes and rotors alone.
    """

    square: float
    viscous: float
    damped: float
    of_axes: float
    longest: float


class DampedIdlers(ReferenceState):
    """A stage whose idlers' speeds are found together where the belts are damped much."""

    def __init__(self, *given: Any) -> None:
        """Nothing turns yet."""
        super().__init__(*given)
        self.hooked = self.runs("runout")
        self.tied = False
        self.friction, self.lawful, self.turned = np.zeros((3, len(self.a["q"]) - 4))

    def turn_idlers(self, arm: Array, middle: Array) -> Array:
        """Speeds (n - 4,) of the idlers in the middle of the coming step: with the belts' damping
        they solve one linear system (`damped_code.py`); ``arm`` and ``middle`` are (n,).
        """
        a, known, old = self.a, np.r_[middle[:4], np.zeros(len(middle) - 4)], self.a["v"][4:]
        rows, dashpots = self.row * arm, a["stiffness"] * a["belt_time"]
        pull = a["stiffness"] * a["elongation"] + dashpots * (rows @ known)
        tied, inert = self._tied(arm)
        push = inert * old - rows[:, 4:].T @ pull + self.lawful - self.friction
        even = np.linalg.solve(tied, push)
        if self.hooked:
            return np.asarray(even)
        self._slide(tied, even)
        return np.asarray(0.5 * (old + self.turned))

    def turn_lawfully(self, arm: Array, middle: Array, lawful: Array) -> None:
        """Behind laws on the tensions, which now add so much torque (n - 4,) to the idlers."""
        tied, _ = self._tied(arm)
        self._slide(tied, middle[4:] + np.linalg.solve(tied, lawful - self.lawful))
        self.lawful = lawful

    def _tied(self, arm: Array) -> tuple[Array, Array]:
        """What a mean speed of the idlers costs in torque, by the belts and by inertia alone."""
        a, rows = self.a, (self.row * arm)[:, 4:]
        inert = 2 * a["mass"][4:] / self.step
        dashpots = a["stiffness"] * a["belt_time"]
        return np.diag(inert + a["damping0"][4:]) + rows.T @ (dashpots[:, None] * rows), inert

    def _slide(self, tied: Array, even: Array) -> None:
        """Speeds at the end of the step, and the friction of its mean speeds ``even``."""
        after, smooth = 2 * even - self.a["v"][4:], self.smoothing()[4:]
        away = 2 * np.diag(np.diag(tied)) - np.abs(tied)
        give = 2 * np.linalg.solve(away, np.ones(len(even)))
        fast = after + give * self.friction
        most = np.asarray(give * np.maximum(self.a["bound0"][4:], 0))
        self.turned = left_by_friction(fast, most, smooth)
        self.friction = self.friction + (after - self.turned) / give

    def tie(self) -> None:
        """Find whether extrapolated rates would ask for a step much shorter than the machine's."""
        p = self.poles()
        own = STEP_RESOLUTION / np.sqrt(max(p.square, p.viscous**2))
        rated = STEP_RESOLUTION / max(p.damped, 1e-9)
        more = bool((self.a["belt_time"] > self.a["damping_time"][0]).any())
        tied = more and len(self.a["q"]) > 4 and not self.runs("tension")
        self.tied = tied and bool(rated * TIED < min(own, p.longest))

    def poles(self) -> Poles:
        """By Gershgorin's bound, sections that change at a quarter of their length."""
        stiffness, time = self._stiffest()
        free = np.array([True, True, *self.released, *[True] * (len(self.a["q"]) - 4)])
        mass, rate = self.a["mass"][free], self.a["damping0"] / self.a["mass"]
        rows = np.abs(self.stage.rows(self.radius))[:, free]
        spring = rows.T @ (stiffness[:, None] * rows) / np.sqrt(np.outer(mass, mass))
        axes = spring[: free[:4].sum(), : free[:4].sum()]
        square, of_axes = (max(float(k.sum(axis=1).max(initial=1.0)), 1.0) for k in (spring, axes))
        viscous = float(rate[free].max()) * STEP_RESOLUTION / 3.0
        calm = min([STEP_CALM, *rate[4:]]) if len(rate) > 4 else 0.0
        longest = STEP_LONGEST * (1.0 + 2.0 * calm / STEP_CALM)
        return Poles(square, viscous, time * square, time * of_axes, longest)

    def _stiffest(self) -> tuple[Array, float]:
        """Stiffness [N/m] of sections, and the longest damping [s]."""
        a = self.a
        self.find_stiffness()
        a["stiffness"], a["length"] = a["stiffness0"].copy(), 0.25 * a["length0"]
        self.run_port("belt")
        return a["stiffness"], float(a["belt_time"].max(initial=0.0))

    def find_stiffness(self) -> None:
        """Stiffness [N/m] and damping [s] of the sections at the present place."""
        a, sections = self.a, len(self.stage.sections)
        a["stiffness"], a["slope"] = a["stiffness0"].copy(), np.zeros(sections)
        a["belt_time"] = np.full(sections, a["damping_time"][0])
        a["length"] = a["length0"] + self.slopes @ a["q"][:2]
        self.run_port("belt")

    def smoothing(self) -> Array:
        """Speed scale (n,) of Coulomb friction."""
        rim = self.nominal["pulley_smoothing_ratio"] / self.radius
        ratio = np.r_[1, 1, np.full(len(self.a["q"]) - 2, rim)]
        return np.asarray(self.nominal["friction_smoothing"] * ratio)


def left_by_friction(speed: Array, most: Array, smooth: Array) -> Array:
    """What Coulomb friction leaves of speeds (n,), ``most`` off high ones: the least of four lines
    of min(x, a + b x, .., 1), x = |v| / v_s, each solved implicitly; set-valued at v_s = 0.
    """
    taken = most.copy()
    for a, b in ROUNDED:
        gain = np.divide(most * b, smooth + most * b, out=np.ones_like(most), where=smooth > 0)
        taken = np.minimum(taken, gain * np.abs(speed) + most * a * (1 - gain))
    return np.asarray(speed - np.copysign(taken, speed))
