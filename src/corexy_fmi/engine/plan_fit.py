"""E and E_sep of a plan by fits: what the retuned machine, and each near rival, leave of an effect.

A linear signature knows a rival at the shapes that its file begins with; fitted, its time constant
or phase may come nearer, and friction bends what retuning takes up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fit import Fit, minimise
from corexy_fmi.engine.foresee import filled
from corexy_fmi.engine.idle import idle
from corexy_fmi.engine.name import THRESHOLD
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.screen import Lead, screen
from corexy_fmi.engine.signature import row_of
from corexy_fmi.engine.unknowns import Hypothesis
from corexy_fmi.kernel.layout import Instance

FIRST, ITERATIONS = 2, 8  # iterations from each of a rival's starts; from the best of them


def distances(
    base: Fit, instance: Instance, values: dict[str, float], rivals: Sequence[Instance]
) -> tuple[float, float, list[Instance]]:
    """E of an effect at these values on a program's bare fit, E_sep, and the rivals, nearest first.

    Without rivals E_sep is E.  One that does as well without its size (`idle.py`) is none.
    """
    retuned = minimise(_shown(base, instance, values), base.u, ITERATIONS)
    leads = screen(retuned, [Hypothesis((i,)) for i in rivals])
    fits = [fit for fit in map(_fitted, leads) if not idle(fit, THRESHOLD)]
    left = {fit.problem.hypothesis.uses[0]: _distance(fit) for fit in fits}
    order = sorted(left, key=lambda i: left[i])
    shown = _distance(retuned)
    return shown, min([shown, *left.values()]), order


def _shown(base: Fit, instance: Instance, values: dict[str, float]) -> Problem:
    """The bare machine before what an effect would show, without noise."""
    problem = replace(base.problem, hypothesis=Hypothesis((instance,)))
    vector = row_of(problem, np.zeros(problem.size), instance, values)
    run = filled(base.problem.runs[0], problem.simulate(vector[None], 0)[0])
    return replace(base.problem, runs=(run,))


def _fitted(lead: Lead) -> Fit:
    """A rival fitted, nominal machine and all."""
    near = lead.borrowed()
    begun = [minimise(lead.problem, u, FIRST, borrowed=near) for u in lead.starts]
    best = min(begun, key=lambda fit: fit.cost)
    return minimise(lead.problem, best.u, ITERATIONS)


def _distance(fit: Fit) -> float:
    """Squared distance [1] that a fit leaves."""
    return max(2 * (fit.cost - fit.problem.log_scale()), 0.0)
