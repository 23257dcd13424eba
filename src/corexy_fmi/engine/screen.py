"""Score test: what each hypothesis would gain, from its signature at the retuned machine.

One lane for each start of each candidate; the signature is projected off all that retuning can
do, and regressed on the residual.  It orders the candidates and gives their fits a start.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.candidates import starts
from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.unknowns import Hypothesis
from corexy_fmi.kernel.call import Array


@dataclass(frozen=True, eq=False)
class Lead:
    """A hypothesis added to a ``base`` fit: linear gain [nats], internal vectors to start from.

    ``bound`` is how many times its start's size the effect may have at most, at 95 %.
    """

    hypothesis: Hypothesis
    problem: Problem
    gain: float
    starts: tuple[Array, ...]
    base: Fit
    bound: float = 0.0

    def borrowed(self) -> Array:
        """The base's Jacobian for this problem; NaN in the columns of what was added."""
        old = {x.key: k for k, x in enumerate(self.base.problem.unknowns)}
        count, size = len(self.problem.unknowns), self.problem.size
        samples = len(self.base.residual) - self.base.problem.size
        result = np.full((samples + size, size), np.nan)
        pairs = [(k, old[x.key]) for k, x in enumerate(self.problem.unknowns) if x.key in old]
        pairs += [(k, k - count + len(old)) for k in range(count, size)]
        columns, sources = map(list, zip(*pairs, strict=True))
        result[:samples, columns] = self.base.jacobian[:samples, sources]
        result[samples:, columns] = np.diag(self.problem.prior[1])[:, columns]
        return result


@dataclass(frozen=True, eq=False)
class _Probe:
    """Internal vectors (sets, size) of one lead before their signatures are known."""

    problem: Problem
    vectors: Array
    neutral: Array


def _embed(base: Fit, problem: Problem) -> Array:
    """The base fit's u in a problem that has more unknowns; the new ones at zero."""
    old = {x.key: base.u[k] for k, x in enumerate(base.problem.unknowns)}
    u = np.array([old.get(x.key, 0.0) for x in problem.unknowns])
    return np.concatenate([u, base.u[len(base.problem.unknowns) :]])


def _probe(base: Fit, hypothesis: Hypothesis, problem: Problem) -> _Probe:
    u = _embed(base, problem)
    keys = [x.key for x in problem.unknowns]
    if hypothesis.law:
        own = [k for k, key in enumerate(keys) if key.startswith("free_form")]
        vectors = np.repeat(u[None], len(own), axis=0)
        vectors[np.arange(len(own)), own] = 1.0
        return _Probe(problem, vectors, u)
    instance = hypothesis.uses[-1]
    prefix = f"{instance.effect.name}.{instance.location}."
    rows = []
    for values in starts(instance):
        row = u.copy()
        for name, value in values.items():
            k = keys.index(prefix + name)
            row[k] = problem.unknowns[k].internal(value)
        rows.append(row)
    return _Probe(problem, np.array(rows), u)


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


def _changes(base: Fit, probe: _Probe, q: Array) -> Array:
    """Change of the residual (sets, samples + base size) by each probe, off the base's reach."""
    problem, count = probe.problem, sum(r.count for r in probe.problem.runs)
    white = problem.residual(probe.vectors)[:, :count]
    change = np.zeros((len(white), len(base.residual)))
    change[:, :count] = white - base.residual[:count]
    return change - (change @ q) @ q.T


def _scaled(probe: _Probe, row: Array, factor: float, hypothesis: Hypothesis) -> Array:
    """A start whose size follows the linear estimate, kept within a factor of thirty."""
    effect = hypothesis.uses[-1].effect
    keys = [x.key for x in probe.problem.unknowns]
    k = next(
        i
        for i, key in enumerate(keys)
        if key.endswith(f"{hypothesis.uses[-1].location}.{effect.size.name}")
        and key.startswith(effect.name)
    )
    unknown, start = probe.problem.unknowns[k], row.copy()
    if unknown.log:
        growth = float(np.clip(factor, 0.02, 50.0)) ** effect.size.scaling
        start[k] = unknown.internal(float(unknown.value(row[k])) * growth)
    else:
        start[k] = unknown.internal(
            unknown.centre + float(np.clip(factor, -30, 30)) * row[k] * unknown.scale
        )
    low, high = probe.problem.limits()
    return np.clip(start, low, high)


def _lead(base: Fit, hypothesis: Hypothesis, problem: Problem, q: Array) -> Lead:
    probe = _probe(base, hypothesis, problem)
    changes = _changes(base, probe, q)
    if hypothesis.law:
        gain, factors = _gain_many(base.residual, changes)
        start = probe.neutral.copy()
        own = [k for k, x in enumerate(problem.unknowns) if x.key.startswith("free_form")]
        start[own] = np.clip(factors, -100, 100)
        return Lead(hypothesis, problem, gain, (start,), base)
    scored, bound = [], 0.0
    positive = hypothesis.uses[-1].effect.size.lower >= 0
    for row, change in zip(probe.vectors, changes, strict=True):
        gain, factor = _gain_one(base.residual, change)
        bound = max(bound, abs(factor) + 1.645 / max(float(np.linalg.norm(change)), 1e-9))
        if positive and factor <= 0:
            gain, factor = 0.0, 0.05
        scored.append((gain, _scaled(probe, row, factor, hypothesis)))
    linear = max(gain for gain, _ in scored)
    if any(p.periodic for p in hypothesis.uses[-1].effect.parameters):
        linear = max(linear, _gain_many(base.residual, changes)[0])
    reached, order = _reach(base, problem, np.array([start for _, start in scored]), q)
    return Lead(
        hypothesis, problem, max(linear, reached), tuple(scored[n][1] for n in order), base, bound
    )


def _reach(base: Fit, problem: Problem, starts: Array, q: Array) -> tuple[float, list[int]]:
    """Gain [nats] of the best start as it is, nominal parameters retuned linearly; best first."""
    count = sum(r.count for r in problem.runs)
    with np.errstate(over="ignore", invalid="ignore"):
        white = np.zeros((len(starts), len(base.residual)))
        white[:, :count] = problem.residual(starts)[:, :count]
        left = white - (white @ q) @ q.T
        costs = 0.5 * np.sum(left**2, axis=1)
    costs = np.where(np.isfinite(costs), costs, np.inf)
    own = base.residual - q @ (q.T @ base.residual)
    return 0.5 * float(own @ own) - float(costs.min()), [
        int(n) for n in np.argsort(costs, kind="stable")
    ]


def screen(base: Fit, candidates: list[Hypothesis], mapper: object = map) -> list[Lead]:
    """Every candidate's lead, best first; ``mapper`` may be an executor's map."""
    q, _ = np.linalg.qr(base.jacobian)
    first = base.problem

    def one(hypothesis: Hypothesis) -> Lead:
        problem = replace(first, hypothesis=hypothesis)
        return _lead(base, hypothesis, problem, q)

    leads = list(mapper(one, candidates))  # type: ignore[operator]
    return sorted(leads, key=lambda lead: -lead.gain)
