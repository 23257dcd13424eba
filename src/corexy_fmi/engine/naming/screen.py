"""Score test: what each hypothesis would gain, from its signature at the retuned machine.

One lane for each start of each candidate; the signature is projected off all that retuning can
do, and regressed on the residual.  Starts that differ by a phase alone span one wave, whose size
and phase follow at once.  It orders the candidates and gives their fits a start.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.free_form import law_places
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.abreast import Steps, in_companies, residuals
from corexy_fmi.engine.naming.beyond import Beyond, at_step_of, beyond
from corexy_fmi.engine.naming.by_run import by_run
from corexy_fmi.engine.naming.signature import (
    TRIED,
    Score,
    changes,
    gain_many,
    row_of,
    score_of,
    scores,
    within_threshold,
)
from corexy_fmi.engine.naming.spread import Spread, spread
from corexy_fmi.engine.naming.untold import untold
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

KEPT, WORTH = 4, 0.3  # starts that a lead offers at most; share of the best one's gain
BESIDE = 0.25  # of a start, in every unknown: it would end where that does


@dataclass(frozen=True, eq=False)
class Lead:
    """A hypothesis added to a ``base`` fit: linear gain [nats], internal vectors to start from.

    ``bound``: the strength that the effect may have at most, at 95 % (`untold.py`); 0: not asked.
    """

    hypothesis: Hypothesis
    problem: Problem
    gain: float
    starts: tuple[Array, ...]
    base: Fit
    bound: float = 0.0

    def borrowed(self) -> Array:
        """The base's Jacobian for this problem; NaN in the columns of what was added."""
        old = {key: k for k, key in enumerate(self.base.problem.keys)}
        size, samples = self.problem.size, len(self.base.residual) - self.base.problem.size
        result = np.full((samples + size, size), np.nan, order="F")
        pairs = [(k, old[key]) for k, key in enumerate(self.problem.keys) if key in old]
        columns, sources = map(list, zip(*pairs, strict=True))
        result.T[columns, :samples] = self.base.jacobian.T[sources, :samples]
        result[samples:, columns] = np.diag(self.problem.prior[1])[:, columns]
        return result


def _lead(behind: Beyond, problem: Problem, offered: Spread) -> Steps[Lead]:
    base, hypothesis = behind.fit, problem.hypothesis
    u = problem.carried(base.problem, base.u)
    if hypothesis.law:
        return (yield from _law_lead(behind, problem, u))
    instance = hypothesis.uses[-1]
    found, gains, starts = yield from _tried(behind, problem, instance, offered)
    if any(p.heard for p in instance.effect.parameters) and offered.modes:
        swinging = replace(offered, swings=offered.modes)  # which are not sought again
        more = yield from _tried(behind, problem, instance, swinging)
        found, gains, starts = max(found, more[0]), [*gains, *more[1]], [*starts, *more[2]]
    order = np.argsort(-np.array(gains), kind="stable")
    linear = max(found, gains[order[0]])
    return Lead(hypothesis, problem, linear, tuple(starts[n] for n in order), base)


def _tried(
    behind: Beyond, problem: Problem, instance: Instance, offered: Spread
) -> Steps[tuple[float, list[float], list[Array]]]:
    """The best linear gain [nats] of an effect's starts, and those kept after a trial of the best
    with their sizes: what each gains, and its internal vector.
    """
    found = yield from every_start(behind, problem, instance, offered)
    u = problem.carried(behind.fit.problem, behind.fit.u)
    tried = 2 * TRIED if instance.effect.size.over == "threshold" else TRIED
    starts = np.array([row_of(problem, u, instance, s.values) for s in found[:tried]])
    gains = behind.gains((yield from residuals(problem, starts)))
    order = apart(starts, gains)
    top = float(gains[order[0]])
    kept = [n for n in order if n == order[0] or gains[n] > WORTH * top > 0 or top <= 0]
    return found[0].gain, [float(gains[n]) for n in kept], [starts[n] for n in kept]


def apart(starts: Array, gains: Array) -> list[int]:
    """Which of the starts (starts, size) are kept, best first: none beside a better one."""
    kept: list[int] = []
    for n in np.argsort(-gains, kind="stable"):
        if len(kept) < KEPT and all(np.abs(starts[n] - starts[m]).max() > BESIDE for m in kept):
            kept.append(int(n))
    return kept


def every_start(
    behind: Beyond, problem: Problem, instance: Instance, offered: Spread
) -> Steps[list[Score]]:
    """Scores of all starts of one effect, best first."""
    base = behind.fit
    u = problem.carried(base.problem, base.u)
    if instance.effect.size.over == "threshold":
        within = yield from within_threshold(base, problem, instance, u)
        offered = replace(offered, threshold=within)
    score = by_run if by_one_run(instance) else scores
    return (yield from score(behind, problem, instance, u, offered))


def by_one_run(instance: Instance) -> bool:
    """Whether an effect's time or phase belongs to one recording."""
    return any(p.local and (p.over or p.periodic) for p in instance.effect.parameters)


def _law_lead(behind: Beyond, problem: Problem, u: Array) -> Steps[Lead]:
    """A free-form law: all of its values at once."""
    own = law_places(problem.unknowns)
    vectors = np.repeat(u[None], len(own), axis=0)
    vectors[np.arange(len(own)), own] = 1.0
    gain, factors = gain_many(*behind.of((yield from changes(behind.fit, problem, vectors))))
    start = u.copy()
    start[own] = np.clip(factors, -100, 100)
    return Lead(problem.hypothesis, problem, gain, (start,), behind.fit)


def bounds(base: Fit, candidates: list[Instance], mapper: Mapper = map) -> list[Lead]:
    """Leads of effects on top of what a fit holds, as far as their bounds go: none is tried as a
    start.
    """
    behind, offered, said = beyond(base), spread(base), base.problem.hypothesis
    added = [replace(said, uses=(*said.uses, instance)) for instance in candidates]
    problems = [replace(base.problem, hypothesis=hypothesis) for hypothesis in added]
    return in_companies(lambda problem: _bound(behind, problem, offered), problems, mapper)


def _bound(behind: Beyond, problem: Problem, offered: Spread) -> Steps[Lead]:
    base, instance = behind.fit, problem.hypothesis.uses[-1]
    found, again = (yield from every_start(behind, problem, instance, offered)), None
    if not (by_one_run(instance) or instance.effect.frees_rotor):  # another stage, told or not
        u = problem.carried(base.problem, base.u)
        again = partial(score_of, at_step_of(behind, problem), problem, instance, u)
    bound = yield from untold(instance, found, again)
    return Lead(problem.hypothesis, problem, found[0].gain, (), base, bound)


def screen(base: Fit, candidates: list[Hypothesis], mapper: Mapper = map) -> list[Lead]:
    """Every candidate's lead, best first; ``mapper`` may be an executor's map."""
    behind, offered = beyond(base), spread(base)
    problems = [replace(base.problem, hypothesis=hypothesis) for hypothesis in candidates]
    leads = in_companies(lambda problem: _lead(behind, problem, offered), problems, mapper)
    return sorted(leads, key=lambda lead: -lead.gain)
