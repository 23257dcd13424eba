"""What a machine may be asked to run: by a fit, its rotors stay in step and its belts stretch not
much farther than in its recordings.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.effects.api import ROTOR_TEETH, STEPPER
from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.planning.foresee import Sensing, onto, placed
from corexy_fmi.kernel.call import Array
from corexy_fmi.motion import place

HALF_CYCLE = np.pi / ROTOR_TEETH  # [rad] behind its field, where a rotor is let go
STRAIN = 5.0  # times what recordings stretched the belts; shaken at what it rings at, 12 were seen


def bears(fit: Fit, run: Run, sensing: Sensing, seen: float) -> bool:
    """Whether, by a fit, a machine runs an imagined run unharmed; ``seen`` as of `strain`."""
    problem = onto(fit, run, sensing)
    shown = _turned(problem, placed(fit, problem), 0)
    return not _falls_out(problem, shown) and _stretch(problem, shown) <= STRAIN * seen


def strain(fit: Fit) -> float:
    """How far [m], by a fit, its recordings stretched the belts at most."""
    runs = range(len(fit.problem.runs))
    return max(_stretch(fit.problem, _turned(fit.problem, fit.u, run)) for run in runs)


def _turned(problem: Problem, u: Array, run: int) -> Array:
    """Angles of the motors [rad] and the effector's place [m], (4, rows)."""
    return problem.simulate(u[None], run, ("phi1", "phi2", "x", "y"))[0]


def _falls_out(problem: Problem, shown: Array) -> bool:
    """Whether a stepper's rotor leaves the field that turns it: what follows tells of lost steps,
    not of what was missing.
    """
    if problem.machine.drive != STEPPER:
        return False
    excitation = problem.runs[0].excitation
    asked = np.array([excitation.input1, excitation.input2])
    return not bool(np.abs(shown[:2] - asked).max() < HALF_CYCLE)


def _stretch(problem: Problem, shown: Array) -> float:
    """How far [m] the effector is from where the motors' angles alone would have it, eq. (1)."""
    phi1, phi2, x, y = shown
    stiff = place(phi1, phi2, problem.machine.parameters["pulley_radius"])
    return float(np.abs(np.array([x, y]) - stiff).max())
