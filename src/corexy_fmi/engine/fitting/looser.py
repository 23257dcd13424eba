"""Looser priors: intervals that also hold where a machine file is further off than it says.

What a file says of masses, stiffnesses and frictions pulls on the size of an effect that resembles
them.  Where the file is off by a deviation in the effect's own direction, its interval misses the
truth, however many data there are: a prior's mean does not widen it.  So the winner is fitted once
more with priors that tell little, and its intervals reach as far as either fit's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.rough import softened

LOOSE = 3.0  # times as wide as the machine file's priors
ROUNDS = 10  # iterations at most: it begins at the winner


def loose(problem: Problem, times: float = LOOSE) -> Problem:
    """The same problem under priors that are so many times as wide."""
    machine = problem.machine
    wide = replace(machine, rel_std={k: times * std for k, std in machine.rel_std.items()})
    return replace(problem, machine=wide)


def loosened(fit: Fit) -> Fit | None:
    """A fit of effects once more under priors that are `LOOSE` times as wide, with slopes averaged
    where the fit's are; None where it holds none, or breaks down.
    """
    if not fit.problem.hypothesis.uses:
        return None
    found = minimise(loose(fit.problem), fit.u, ROUNDS)
    if not np.isfinite(found.cost):
        return None
    return found if fit.slopes is None else softened(found)
