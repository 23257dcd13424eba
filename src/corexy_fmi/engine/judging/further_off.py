"""Whether the machine file alone, further off than it says, explains a mismatch as well as a cause.

A file that is wrong by a factor holds retuning back by its priors, and a cause that stands in for
the parameter is not held back.  What it gains is then the priors', not the data's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.looser import ROUNDS, loose
from corexy_fmi.engine.fitting.starts import astray, pulls
from corexy_fmi.engine.judging.doubt import incomplete
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming.entries import THRESHOLD, Competition, Entry
from corexy_fmi.engine.naming.search import penalty, samples_of

FREE = 30.0  # times as wide priors, which tell next to nothing
STRANGE = 0.5  # share of them beyond that makes it another machine's file
FAR = 3.0  # prior deviations of a nominal parameter, beyond which the file is doubted (CONTRACT 4)


def beside_retuned(verdict: Verdict, competition: Competition) -> Verdict:
    """A named cause beside retuned parameters, where those explain as much once they may go
    further off the machine file, nothing where data kept back refuted it; any other verdict as it
    is.
    """
    best = verdict.entry
    if verdict.refuted and explains_as_much(competition.retuned, verdict.refuted):
        return Verdict("nothing_missing", None)
    if best is None or best.hypothesis.law or verdict.word not in ("explained", "ambiguous"):
        return verdict
    if () in (key for group in verdict.classes for key in group):
        return verdict
    if not explains_as_much(competition.retuned, best):
        return verdict
    known = verdict.classes or ((best.hypothesis.key,),)
    return replace(verdict, word="ambiguous", classes=tuple((*group, ()) for group in known))


def explains_as_much(retuned: Fit, best: Entry) -> bool:
    """Whether retuning that went far, under looser priors, leaves of the data no more than a cause
    does, but for what its parameters cost.
    """
    if astray(retuned) < FAR:
        return False
    noise, own = best.fit.problem.noise, best.fit.problem
    problem = replace(loose(retuned.problem, FREE), noise=noise, runs=own.runs)
    starts = (retuned.u, problem.carried(own, best.fit.u))
    least = min(_of_data(minimise(problem, u, ROUNDS)) for u in starts)
    return least < _of_data(best.fit) + penalty(own, samples_of(best.fit)) + THRESHOLD


def another_machine(verdict: Verdict) -> Verdict:
    """A cause beside which most nominal parameters lie where no file of this machine would have
    them: it may be another machine's file, and the cause what that cannot be retuned to.
    """
    best = verdict.entry
    if best is None or verdict.word not in ("explained", "ambiguous"):
        return verdict
    off = pulls(best.fit)
    if np.mean(off > FAR) <= STRANGE:
        return verdict
    told = f"{int((off > FAR).sum())} of {len(off)} nominal parameters are beyond {FAR:.0f} sigma"
    return incomplete(verdict, f"{told}: the machine file would be another machine's")


def _of_data(fit: Fit) -> float:
    """Cost [nats] of what a fit leaves of the data, but for what its parameters' priors cost."""
    left = fit.residual[: samples_of(fit)]
    return 0.5 * float(left @ left) + fit.problem.log_scale()
