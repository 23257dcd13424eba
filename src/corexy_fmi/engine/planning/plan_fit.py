"""E and E_sep of a plan by fits: what the retuned machine, and each near rival, leave of an effect.

A linear signature knows a rival at the shapes that its file begins with; fitted, its time constant
or phase may come nearer, and friction bends what retuning takes up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.entries import THRESHOLD
from corexy_fmi.engine.naming.idle import idle
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.signature import row_of
from corexy_fmi.engine.planning.foresee import filled
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

ITERATIONS, ENOUGH, SECANTS = 8, 0.3, 3  # of a fit; [nats]


@dataclass(eq=False)
class Rivalry:
    """An effect against its rivals on a program's bare fit; each fit begins where the last, of
    another size, ended.
    """

    base: Fit
    instance: Instance
    rivals: Sequence[Instance]
    ends: dict[tuple[Instance, ...], Array] = field(default_factory=dict)

    def distances(self, values: dict[str, float]) -> tuple[float, float, list[Instance]]:
        """E of the effect at these values; E_sep less what its parameters cost beyond a rival's;
        the rivals, nearest first.

        Without rivals E_sep is E.  One that does as well without its size (`idle.py`) is none.
        """
        problem = self._shown(values)
        retuned = self._on(problem, self.ends.get((), self.base.u))
        found = [self._rival(retuned, i) for i in self.rivals]
        fits = [fit for fit in found if not idle(fit, THRESHOLD)]
        own = cost_of(problem, self.instance)
        left = {
            i: _distance(fit) + cost_of(problem, i) - own
            for fit in fits
            for i in fit.problem.hypothesis.uses
        }
        shown = _distance(retuned)
        return shown, min([shown, *left.values()]), sorted(left, key=lambda i: left[i])

    def _shown(self, values: dict[str, float]) -> Problem:
        """The bare machine before what the effect would show, without noise."""
        problem = replace(self.base.problem, hypothesis=Hypothesis((self.instance,)))
        vector = row_of(problem, np.zeros(problem.size), self.instance, values)
        run = filled(self.base.problem.runs[0], problem.simulate(vector[None], 0)[0])
        return replace(self.base.problem, runs=(run,))

    def _rival(self, retuned: Fit, rival: Instance) -> Fit:
        """A rival fitted, nominal machine and all."""
        problem = replace(retuned.problem, hypothesis=Hypothesis((rival,)))
        start = self.ends.get((rival,))
        return self._on(problem, _begun(retuned, rival) if start is None else start)

    def _on(self, problem: Problem, start: Array) -> Fit:
        fit = minimise(problem, start, ITERATIONS, ENOUGH, secants=SECANTS)
        self.ends[problem.hypothesis.uses] = fit.u
        return fit


def _begun(retuned: Fit, rival: Instance) -> Array:
    """The best of a rival's starts after one step from each."""
    lead = screen(retuned, [Hypothesis((rival,))])[0]
    near = lead.borrowed()
    begun = [minimise(lead.problem, u, 1, borrowed=near) for u in lead.starts]
    return min(begun, key=lambda fit: fit.cost).u


def cost_of(problem: Problem, instance: Instance) -> float:
    """What the parameters of an effect cost (BIC), as a squared distance [1]."""
    drive, parameters = problem.machine.drive, instance.effect.parameters
    count = sum(drive in p.drives and not (p.initial or p.shape) for p in parameters)
    return count * float(np.log(problem.runs[0].count))


def _distance(fit: Fit) -> float:
    """Squared distance [1] that a fit leaves."""
    return max(2 * (fit.cost - fit.problem.log_scale()), 0.0)
