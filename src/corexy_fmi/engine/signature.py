"""Signatures: what each start of an effect would change, and what it would gain.

A signature is the change of the whitened residuals, off all that retuning can do; regressed on the
residual it gives a linear gain and a size.  Starts that differ by a phase alone span one wave.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.slopes import BROKEN
from corexy_fmi.engine.spread import Spread, combinations, combined, groups, phase_of
from corexy_fmi.kernel.call import LANES, Array
from corexy_fmi.kernel.layout import Instance

TRIED = 2 * LANES  # starts that are scored, and then tried, at once
ACTS, ZOOMS = 1e-3, 2  # [std] by which an effect shows at all; rounds that find where
WITHIN = (1e-3, 0.3)  # how far within the threshold half of the fits begin, as shares of it
DEEP = (0.6, 0.05)  # of it, from which the others begin: one stray sample may set the threshold
SHY = (0.0, 0.125, 0.4)  # of the way, on a logarithmic scale, to where a start would grow


def row_of(problem: Problem, u: Array, instance: Instance, values: Mapping[str, float]) -> Array:
    """The internal vector with the parameters of one effect set; ``name@run`` goes before name."""
    row, prefix = u.copy(), f"{instance.effect.name}.{instance.location}."
    for k, unknown in enumerate(problem.unknowns):
        name = unknown.key.removeprefix(prefix)
        if name != unknown.key:
            row[k] = unknown.internal(values.get(name, values[name.partition("@")[0]]))
    return row


def gain_one(residual: Array, change: Array) -> tuple[float, float]:
    """Gain [nats] and factor of one signature."""
    power = float(change @ change)
    factor = -float(residual @ change) / power if power > 1e-12 else 0.0
    return 0.5 * factor**2 * power, factor


def gain_many(residual: Array, changes: Array) -> tuple[float, Array]:
    """Gain and factors of several signatures (sets, samples) together, lightly ridged."""
    normal = changes @ changes.T
    ridge = 1e-6 * np.trace(normal) / len(normal) + 1e-9
    factors = -np.linalg.solve(normal + ridge * np.eye(len(normal)), changes @ residual)
    fitted = residual + factors @ changes
    return 0.5 * float(residual @ residual - fitted @ fitted), factors


def raw_changes(base: Fit, problem: Problem, vectors: Array) -> Array:
    """Change of the residual (sets, samples + base size) by each vector; 0 where it breaks down."""
    count = sum(r.count for r in problem.runs)
    white = problem.residual(vectors)[:, :count]
    change = np.zeros((len(white), len(base.residual)))
    with np.errstate(over="ignore", invalid="ignore"):
        change[:, :count] = white - base.residual[:count]
    reach = np.maximum(change.max(axis=1, initial=0.0), -change.min(axis=1, initial=0.0))
    change[~(reach < BROKEN)] = 0.0
    return change


def changes(base: Fit, problem: Problem, vectors: Array, q: Array) -> Array:
    """The same, off the base's reach."""
    change = raw_changes(base, problem, vectors)
    change -= (change @ q) @ q.T
    return change


def grown(instance: Instance, values: Mapping[str, float], factor: float) -> dict[str, float]:
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


def within_threshold(
    base: Fit, problem: Problem, instance: Instance, u: Array
) -> tuple[float, ...]:
    """Sizes (TRIED,) just within the threshold of an effect on these data, and far below it."""
    size = instance.effect.size
    others = {p.name: p.starts[0] for p in instance.effect.parameters}
    tried = np.array(sorted(size.starts))
    for _ in range(1 + ZOOMS):
        rows = [others | {size.name: v} for v in tried]
        vectors = np.array([row_of(problem, u, instance, row) for row in rows])
        acts = np.abs(raw_changes(base, problem, vectors)).max(axis=1) > ACTS
        last = int(np.flatnonzero(acts).max(initial=0))
        tried = np.geomspace(tried[last], tried[min(last + 1, len(tried) - 1)], TRIED)
    half = TRIED // 2
    near, far = 1 - np.geomspace(*WITHIN, half), np.geomspace(*DEEP, half)
    return tuple((tried[0] * np.concatenate([near, far])).tolist())


@dataclass(frozen=True)
class Score:
    """One start: its linear gain [nats], its grown values, and the largest factor at 95 %."""

    gain: float
    values: Mapping[str, float]
    bound: float


def _scored(base: Fit, instance: Instance, rows: list[dict[str, float]], changes: Array) -> Score:
    """The score of one start, or of several that differ by their phase alone."""
    spare = 1.645 / max(float(np.linalg.norm(changes, axis=1).min()), 1e-9)
    phase, size = phase_of(instance), instance.effect.size
    if phase is not None and len(rows) > 1:
        gain, factors = gain_many(base.residual, changes)
        factor, angle = combined(rows, factors, phase)
        larger = grown(instance, {**rows[0], phase.name: angle}, max(factor, 0.02))
        return Score(gain, larger, factor + spare)
    gain, factor = gain_one(base.residual, changes[0])
    bound = abs(factor) + spare
    if size.lower >= 0 and factor <= 0 and len(instance.effect.sizes) == 1:
        gain, factor = 0.0, 0.05
    return Score(gain, grown(instance, rows[0], factor), bound)


def _shy(instance: Instance, row: Mapping[str, float], score: Score) -> list[Score]:
    """The score's start less grown: what is fitted on a logarithmic scale has no linear limit, and
    what a soft threshold hides grows with a high power of its size.
    """
    size = instance.effect.size
    if not size.log:
        return []
    shares = SHY if size.over == "threshold" else (0.0,)
    away = score.values[size.name] / row[size.name]
    return [replace(score, values={**row, size.name: row[size.name] * away**s}) for s in shares]


def scores(
    base: Fit, problem: Problem, instance: Instance, u: Array, q: Array, offered: Spread
) -> list[Score]:
    """Scores of all starts, best first; a few blocks of lanes at a time, to spare memory."""
    rows = combinations(instance, offered)
    together, found = groups(instance, rows), []
    share = max(TRIED // len(together[0]), 1)
    for first in range(0, len(together), share):
        block = [n for group in together[first : first + share] for n in group]
        vectors = np.array([row_of(problem, u, instance, rows[n]) for n in block])
        found_by = dict(zip(block, changes(base, problem, vectors, q), strict=True))
        for group in together[first : first + share]:
            own = np.array([found_by[n] for n in group])
            found.append(_scored(base, instance, [rows[n] for n in group], own))
            found += _shy(instance, rows[group[0]], found[-1])
    return sorted(found, key=lambda score: -score.gain)
