"""Score test: what each hypothesis would gain, from its signature at the retuned machine.

One lane for each start of each candidate; the signature is projected off all that retuning can
do, and regressed on the residual.  Starts that differ by a phase alone span one wave, whose size
and phase follow at once.  It orders the candidates and gives their fits a start.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.spread import Spread, combinations, combined, groups, phase_of, spread
from corexy_fmi.engine.unknowns import Hypothesis
from corexy_fmi.kernel.call import LANES, Array
from corexy_fmi.kernel.layout import Instance

TRIED = 2 * LANES  # starts of one lead that are tried with their estimated sizes
KEPT, WORTH = 4, 0.3  # starts that a lead offers at most; share of the best one's gain


@dataclass(frozen=True, eq=False)
class Lead:
    """A hypothesis added to a fit: linear gain [nats], and internal vectors to start from.

    ``bound`` is how many times its start's size the effect may have at most, at 95 %.
    """

    hypothesis: Hypothesis
    problem: Problem
    gain: float
    starts: tuple[Array, ...]
    bound: float = 0.0


def _embed(base: Fit, problem: Problem) -> Array:
    """The base fit's u in a problem that has more unknowns; the new ones at zero."""
    old = {x.key: base.u[k] for k, x in enumerate(base.problem.unknowns)}
    u = np.array([old.get(x.key, 0.0) for x in problem.unknowns])
    return np.concatenate([u, base.u[len(base.problem.unknowns) :]])


def _row(problem: Problem, u: Array, instance: Instance, values: Mapping[str, float]) -> Array:
    """The internal vector with the parameters of one effect set."""
    row, prefix = u.copy(), f"{instance.effect.name}.{instance.location}."
    for k, unknown in enumerate(problem.unknowns):
        name = unknown.key.removeprefix(prefix)
        if name != unknown.key:
            row[k] = unknown.internal(values[name])
    return row


def _gain_one(residual: Array, change: Array) -> tuple[float, float]:
    """Gain [nats] and factor of one signature."""
    power = float(change @ change)
    factor = -float(residual @ change) / power if power > 1e-12 else 0.0
    return 0.5 * factor**2 * power, factor


def _gain_many(residual: Array, changes: Array) -> tuple[float, Array]:
    """Gain and factors of several signatures (sets, samples) together, lightly ridged."""
    normal = changes @ changes.T
    ridge = 1e-6 * np.trace(normal) / len(normal) + 1e-9
    factors = -np.linalg.solve(normal + ridge * np.eye(len(normal)), changes @ residual)
    fitted = residual + factors @ changes
    return 0.5 * float(residual @ residual - fitted @ fitted), factors


def _changes(base: Fit, problem: Problem, vectors: Array, q: Array) -> Array:
    """Change of the residual (sets, samples + base size) by each vector, off the base's reach."""
    count = sum(r.count for r in problem.runs)
    white = problem.residual(vectors)[:, :count]
    change = np.zeros((len(white), len(base.residual)))
    change[:, :count] = white - base.residual[:count]
    change[~np.isfinite(change).all(axis=1)] = 0.0
    return change - (change @ q) @ q.T


def _grown(instance: Instance, values: Mapping[str, float], factor: float) -> dict[str, float]:
    """A start whose sizes follow the linear estimate, kept within a factor of thirty."""
    found = dict(values)
    for p in instance.effect.sizes:
        away = found[p.name] - p.neutral
        if p.log:
            found[p.name] *= float(np.clip(factor, 0.02, 50.0)) ** p.scaling
        else:
            found[p.name] = p.neutral + float(np.clip(factor, -30, 30)) * away
        found[p.name] = min(max(found[p.name], p.lower), p.upper)
    return found


@dataclass(frozen=True)
class _Score:
    """One start: its linear gain [nats], its grown values, and the largest factor at 95 %."""

    gain: float
    values: Mapping[str, float]
    bound: float


def _scored(base: Fit, instance: Instance, rows: list[dict[str, float]], changes: Array) -> _Score:
    """The score of one start, or of several that differ by their phase alone."""
    spare = 1.645 / max(float(np.linalg.norm(changes, axis=1).min()), 1e-9)
    phase, size = phase_of(instance), instance.effect.size
    if phase is not None and len(rows) > 1:
        gain, factors = _gain_many(base.residual, changes)
        factor, angle = combined(rows, factors, phase)
        grown = _grown(instance, {**rows[0], phase.name: angle}, max(factor, 0.02))
        return _Score(gain, grown, factor + spare)
    gain, factor = _gain_one(base.residual, changes[0])
    bound = abs(factor) + spare
    if size.lower >= 0 and factor <= 0 and len(instance.effect.sizes) == 1:
        gain, factor = 0.0, 0.05
    return _Score(gain, _grown(instance, rows[0], factor), bound)


def _scores(
    base: Fit, problem: Problem, instance: Instance, u: Array, q: Array, offered: Spread
) -> list[_Score]:
    """Scores of all starts, best first; a few blocks of lanes at a time, to spare memory."""
    rows = combinations(instance, offered)
    together, found = groups(instance, rows), []
    share = max(TRIED // len(together[0]), 1)
    for first in range(0, len(together), share):
        block = [n for group in together[first : first + share] for n in group]
        vectors = np.array([_row(problem, u, instance, rows[n]) for n in block])
        changes = dict(zip(block, _changes(base, problem, vectors, q), strict=True))
        for group in together[first : first + share]:
            own = np.array([changes[n] for n in group])
            found.append(_scored(base, instance, [rows[n] for n in group], own))
    return sorted(found, key=lambda score: -score.gain)


def _lead(base: Fit, hypothesis: Hypothesis, problem: Problem, q: Array, offered: Spread) -> Lead:
    u = _embed(base, problem)
    if hypothesis.law:
        return _law_lead(base, hypothesis, problem, u, q)
    instance = hypothesis.uses[-1]
    scores = _scores(base, problem, instance, u, q, offered)
    best = scores[:TRIED]
    starts = np.array([_row(problem, u, instance, s.values) for s in best])
    gains = _reach(base, problem, starts, q)
    order = np.argsort(-gains, kind="stable")[:KEPT]
    top = float(gains[order[0]])
    kept = [n for n in order if n == order[0] or gains[n] > WORTH * top > 0 or top <= 0]
    linear = max(scores[0].gain, top)
    bound = max(score.bound for score in scores)
    return Lead(hypothesis, problem, linear, tuple(starts[n] for n in kept), bound)


def _law_lead(base: Fit, hypothesis: Hypothesis, problem: Problem, u: Array, q: Array) -> Lead:
    """A free-form law: all of its values at once."""
    own = [k for k, x in enumerate(problem.unknowns) if x.key.startswith("free_form")]
    vectors = np.repeat(u[None], len(own), axis=0)
    vectors[np.arange(len(own)), own] = 1.0
    gain, factors = _gain_many(base.residual, _changes(base, problem, vectors, q))
    start = u.copy()
    start[own] = np.clip(factors, -100, 100)
    return Lead(hypothesis, problem, gain, (start,))


def _reach(base: Fit, problem: Problem, starts: Array, q: Array) -> Array:
    """Gain [nats] (sets,) of each start as it is, nominal parameters retuned linearly."""
    count = sum(r.count for r in problem.runs)
    with np.errstate(over="ignore", invalid="ignore"):
        white = np.zeros((len(starts), len(base.residual)))
        white[:, :count] = problem.residual(starts)[:, :count]
        left = white - (white @ q) @ q.T
        costs = 0.5 * np.sum(left**2, axis=1)
    own = base.residual - q @ (q.T @ base.residual)
    return 0.5 * float(own @ own) - np.where(np.isfinite(costs), costs, np.inf)


def screen(base: Fit, candidates: list[Hypothesis], mapper: object = map) -> list[Lead]:
    """Every candidate's lead, best first; ``mapper`` may be an executor's map."""
    q, _ = np.linalg.qr(base.jacobian)
    first, offered = base.problem, spread(base)

    def one(hypothesis: Hypothesis) -> Lead:
        problem = Problem(first.layout, first.machine, first.runs, first.noise, hypothesis)
        return _lead(base, hypothesis, problem, q, offered)

    leads = list(mapper(one, candidates))  # type: ignore[operator]
    return sorted(leads, key=lambda lead: -lead.gain)
