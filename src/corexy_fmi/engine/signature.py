"""Signatures: what each start of an effect would change, and what it would gain.

A signature is the change of the whitened residuals, off all that retuning can do; regressed on the
residual it gives a linear gain and a size.  Starts that differ by a phase alone span one wave.
What belongs to one recording is scored on that recording alone (`by_run`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.spread import Spread, combinations, combined, groups, phase_of
from corexy_fmi.kernel.call import LANES, Array
from corexy_fmi.kernel.layout import Instance

TRIED = 2 * LANES  # starts that are scored, and then tried, at once
ZOOMS, SHOWS = 2, 3.0  # rounds that narrow a time down; [nats] by which a run shows its own part


def row_of(problem: Problem, u: Array, instance: Instance, values: Mapping[str, float]) -> Array:
    """The internal vector with the parameters of one effect set; ``name@run`` goes before name."""
    row, prefix = u.copy(), f"{instance.effect.name}.{instance.location}."
    for k, unknown in enumerate(problem.unknowns):
        name = unknown.key.removeprefix(prefix)
        if name != unknown.key:
            row[k] = unknown.internal(values.get(name, values[name.partition("@")[0]]))
    return row


def _gain_one(residual: Array, change: Array) -> tuple[float, float]:
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


def _raw(base: Fit, problem: Problem, vectors: Array) -> Array:
    """Change of the residual (sets, samples + base size) by each vector; 0 where it breaks down."""
    count = sum(r.count for r in problem.runs)
    white = problem.residual(vectors)[:, :count]
    change = np.zeros((len(white), len(base.residual)))
    with np.errstate(over="ignore", invalid="ignore"):
        change[:, :count] = white - base.residual[:count]
    change[~np.isfinite(change).all(axis=1)] = 0.0
    return change


def changes(base: Fit, problem: Problem, vectors: Array, q: Array) -> Array:
    """The same, off the base's reach."""
    change = _raw(base, problem, vectors)
    return np.asarray(change - (change @ q) @ q.T)


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
        grown = _grown(instance, {**rows[0], phase.name: angle}, max(factor, 0.02))
        return Score(gain, grown, factor + spare)
    gain, factor = _gain_one(base.residual, changes[0])
    bound = abs(factor) + spare
    if size.lower >= 0 and factor <= 0 and len(instance.effect.sizes) == 1:
        gain, factor = 0.0, 0.05
    return Score(gain, _grown(instance, rows[0], factor), bound)


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
            if instance.effect.size.log:  # no linear limit: the declared size is as good a start
                found.append(replace(found[-1], values=rows[group[0]]))
    return sorted(found, key=lambda score: -score.gain)


def _parts(problem: Problem) -> list[slice]:
    """Where the samples of each run stand in the residual."""
    edges = np.cumsum([0, *(run.count for run in problem.runs)])
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _within(change: Array, part: slice, q: Array) -> Array:
    """A raw change (sets, n) of one run alone, off the base's reach."""
    only = np.zeros_like(change)
    only[:, part] = change[:, part]
    return np.asarray(only - (only @ q) @ q.T)


def by_run(
    base: Fit, problem: Problem, instance: Instance, u: Array, q: Array, offered: Spread
) -> list[Score]:
    """Scores of an effect that has parameters of one recording, best first."""
    local = {p.name for p in instance.effect.parameters if p.local}
    shared: dict[tuple[float, ...], list[dict[str, float]]] = {}
    for row in combinations(instance, offered):
        shared.setdefault(tuple(v for n, v in row.items() if n not in local), []).append(row)
    score = _waves if phase_of(instance) else _jumps
    found = [score(base, problem, instance, u, q, rows) for rows in shared.values()]
    return sorted(found, key=lambda s: -s.gain)


def _waves(
    base: Fit,
    problem: Problem,
    instance: Instance,
    u: Array,
    q: Array,
    rows: list[dict[str, float]],
) -> Score:
    """One amplitude, and a phase for each run."""
    phase = phase_of(instance)
    assert phase is not None
    raw = _raw(base, problem, np.array([row_of(problem, u, instance, r) for r in rows]))
    values, sizes, gains, spare = dict(rows[0]), [], [], 0.0
    for run, part in zip(problem.runs, _parts(problem), strict=True):
        change = _within(raw, part, q)
        gain, factors = gain_many(base.residual, change)
        factor, values[f"{phase.name}@{run.name}"] = combined(rows, factors, phase)
        sizes.append(factor)
        gains.append(gain)
        spare = max(spare, 1.645 / max(float(np.linalg.norm(change, axis=1).min()), 1e-9))
    size = float(np.average(sizes, weights=np.array(gains) + 1e-9))
    return Score(sum(gains), _grown(instance, values, max(size, 0.02)), size + spare)


def _jumps(
    base: Fit,
    problem: Problem,
    instance: Instance,
    u: Array,
    q: Array,
    rows: list[dict[str, float]],
) -> Score:
    """A size and a time for each run; the time is narrowed down around the best."""
    size = instance.effect.size
    timed = next(p.name for p in instance.effect.parameters if p.over == "time")
    times = sorted({row[timed] for row in rows})
    spacing = (times[-1] - times[0]) / max(len(times) - 1, 1)
    best = [(0.0, 0.0, rows[0][timed], 0.0)] * len(problem.runs)
    for _ in range(1 + ZOOMS):
        best = _better(base, problem, instance, u, q, rows, timed, best)
        near = spacing * np.linspace(-1, 1, TRIED + 1)
        keys = [f"{timed}@{run.name}" for run in problem.runs]
        rows = [
            rows[0] | {k: b[2] + float(d) for k, b in zip(keys, best, strict=True)} for d in near
        ]
        spacing *= 2 / TRIED
    values = dict(rows[0])
    for run, (gain, factor, time, _) in zip(problem.runs, best, strict=True):
        grown = _grown(instance, rows[0], factor)[size.name]
        values[f"{size.name}@{run.name}"] = grown if gain > SHOWS else size.neutral
        values[f"{timed}@{run.name}"] = time
    return Score(sum(b[0] for b in best), values, max(b[3] for b in best))


def _better(
    base: Fit,
    problem: Problem,
    instance: Instance,
    u: Array,
    q: Array,
    rows: Sequence[dict[str, float]],
    timed: str,
    best: list[tuple[float, float, float, float]],
) -> list[tuple[float, float, float, float]]:
    """Gain [nats], factor, time and bound of the best row of each run, or what was best before."""
    found = list(best)
    for first in range(0, len(rows), LANES):
        block = rows[first : first + LANES]
        raw = _raw(base, problem, np.array([row_of(problem, u, instance, r) for r in block]))
        for r, part in enumerate(_parts(problem)):
            key = f"{timed}@{problem.runs[r].name}"
            for row, change in zip(block, _within(raw, part, q), strict=True):
                gain, factor = _gain_one(base.residual, change)
                spare = abs(factor) + 1.645 / max(float(np.linalg.norm(change)), 1e-9)
                if gain > found[r][0]:
                    found[r] = (gain, factor, row.get(key, row[timed]), spare)
    return found
