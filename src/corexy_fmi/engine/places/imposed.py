"""A run whose motors follow the course that they took: what moves the stage is replayed on it.

What the stage then does to its motors is told, too, as the voltages that would do the same to them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.data.samples import OUTPUT_OF
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.holding import holding_stiffness
from corexy_fmi.engine.fitting.unknowns import PLACES
from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.topology import STAGES


@dataclass(frozen=True, eq=False)
class Course:
    """The motors' course in one run of a fit, and what the stage does there, by output."""

    fit: Fit
    run: int
    excitation: Excitation
    shown: Mapping[str, Array]

    def off(self, turns: Array, forced: bool) -> tuple[dict[str, Array], Array]:
        """What changes (sets, rows) by channel where belts are off as if the motors were by these
        turns (2, sets, rows) [rad], and the voltages (2, sets, rows) [V] that pull as much on
        both motors; nothing where a replay breaks down.  Where that stands for what is ``forced``
        on the stage, eq. (15), no belt is off, and its motors bear that force.
        """
        e = self.excitation
        inputs = np.array([e.input1, e.input2])[:, None] + turns
        there = _simulated(self.fit, self.run, e, inputs)
        with np.errstate(invalid="ignore"):  # of two that broke down
            change = {name: out - self.shown[name] for name, out in there.items()}
        whole = np.all([np.isfinite(off).all(axis=1) for off in change.values()], axis=0)[:, None]
        change = {name: np.where(whole, off, 0.0) for name, off in change.items()}
        machine = self.fit.problem.machine
        sections = STAGES[machine.stage].sections
        lever = machine.parameters["pulley_radius"] / _nominal(self.fit, "motor_torque_gain")
        tensions = np.array([change[f"tension{n + 1}"] for n in range(len(sections))])
        arms = np.array([[s.row.get(phi, 0) for s in sections] for phi in ("phi1", "phi2")])
        held = _stiffness(self.fit) * machine.parameters["pulley_radius"]
        borne = np.where(whole, held * turns, 0.0) if forced else 0.0
        volts = lever * (borne - np.tensordot(arms, tensions, axes=1))
        return {c: change[OUTPUT_OF[c]] for c in _channels(self.fit, self.run)}, volts


def courses(fit: Fit) -> list[Course]:
    """The course of every run."""
    found = []
    for r, run in enumerate(fit.problem.runs):
        one, two = fit.problem.simulate(fit.u[None], r, ("phi1", "phi2"))[0]
        e = replace(run.excitation, mode="angles", input1=one, input2=two, first_angles=None)
        still = np.array([one, two])[:, None]
        found.append(Course(fit, r, e, _simulated(fit, r, e, still)))
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


def _simulated(fit: Fit, run: int, imposed: Excitation, inputs: Array) -> dict[str, Array]:
    """What the stage does (sets, rows), by output, the motors on courses (2, sets, rows)."""
    sections = STAGES[fit.problem.machine.stage].sections
    tensions = [f"tension{n + 1}" for n in range(len(sections))]
    names = (*dict.fromkeys(OUTPUT_OF[c] for c in _channels(fit, run)), *tensions)
    sets = np.repeat(fit.u[None], inputs.shape[1], axis=0)
    out = fit.problem.simulate(sets, run, names, imposed, inputs)
    return dict(zip(names, out.swapaxes(0, 1), strict=True))
