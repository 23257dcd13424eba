"""A run whose motors follow the course that they took: what moves the stage is replayed on it.

What the stage then does to its motors is told, too, as the voltages that would do the same to them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.holding import holding_stiffness
from corexy_fmi.engine.samples import OUTPUT_OF
from corexy_fmi.engine.unknowns import PLACES
from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.topology import STAGES


@dataclass(frozen=True, eq=False)
class Course:
    """The motors' course in one run of a fit, and what the stage does there, by output."""

    fit: Fit
    run: int
    excitation: Excitation
    shown: Mapping[str, Array]

    def off(
        self, turns: tuple[Array, Array], forced: bool
    ) -> tuple[dict[str, Array], tuple[Array, Array]]:
        """What changes (rows,) by channel where belts are off as if the motors were by so much
        [rad], and the voltages (rows,) [V] that pull alike on both motors; nothing where a
        replay breaks down.  Where that stands for what is ``forced`` on the stage, eq. (15), no
        belt is off, and its motors bear that force.
        """
        e = self.excitation
        moved = replace(e, input1=e.input1 + turns[0], input2=e.input2 + turns[1])
        there = _simulated(self.fit, self.run, moved)
        whole = all(np.isfinite(v).all() for v in (*there.values(), *self.shown.values()))
        change = {n: v - self.shown[n] if whole else np.zeros_like(v) for n, v in there.items()}
        machine = self.fit.problem.machine
        sections = STAGES[machine.stage].sections
        lever = machine.parameters["pulley_radius"] / _nominal(self.fit, "motor_torque_gain")
        tensions = np.array([change[f"tension{n + 1}"] for n in range(len(sections))])
        arms = np.array([[s.row.get(phi, 0) for s in sections] for phi in ("phi1", "phi2")])
        held = _stiffness(self.fit) * machine.parameters["pulley_radius"]
        borne = held * np.array(turns) if forced and whole else 0.0
        one, two = lever * (borne - arms @ tensions)
        channels = _channels(self.fit, self.run)
        return {c: change[OUTPUT_OF[c]] for c in channels}, (one, two)


def courses(fit: Fit) -> list[Course]:
    """The course of every run."""
    found = []
    for r, run in enumerate(fit.problem.runs):
        one, two = fit.problem.simulate(fit.u[None], r, ("phi1", "phi2"))[0]
        e = replace(run.excitation, mode="angles", input1=one, input2=two, first_angles=None)
        found.append(Course(fit, r, e, _simulated(fit, r, e)))
    return found


def _stiffness(fit: Fit) -> float:
    """What one belt holds the stage by [N/m], k_e of eq. (15)."""
    machine, key = fit.problem.machine, "belt_axial_stiffness"
    return 0.5 * holding_stiffness(machine) * _nominal(fit, key) / machine.parameters[key]


def _nominal(fit: Fit, name: str) -> float:
    """A nominal parameter, whether it is fitted or not."""
    return float(fit.problem.vectors(fit.u[None], 0)[0, PLACES[name]])


def _channels(fit: Fit, run: int) -> list[str]:
    """What is measured of the stage, not of its motors."""
    names = [s.channel for s in fit.problem.runs[run].samples]
    return [name for name in names if not name.startswith("phi")]


def _simulated(fit: Fit, run: int, excitation: Excitation) -> dict[str, Array]:
    """What the stage does (rows,), by output, the motors on this course."""
    sections = STAGES[fit.problem.machine.stage].sections
    tensions = [f"tension{n + 1}" for n in range(len(sections))]
    names = (*dict.fromkeys(OUTPUT_OF[c] for c in _channels(fit, run)), *tensions)
    out = fit.problem.simulate(fit.u[None], run, names, excitation)[0]
    return dict(zip(names, out, strict=True))
