"""Signatures: what each start of an effect would change, and what it would gain.

A signature is the change of the whitened residuals, off all that retuning can do; regressed on the
residual it gives a linear gain and a size.  Starts that differ by a phase alone span one wave.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.slopes import BROKEN
from corexy_fmi.engine.naming.abreast import Steps, residuals
from corexy_fmi.engine.naming.beyond import Beyond, gain_many, gain_one
from corexy_fmi.engine.naming.spread import Spread, combinations, combined, groups, phase_of
from corexy_fmi.kernel.call import LANES, Array
from corexy_fmi.kernel.layout import Instance

TRIED = 2 * LANES  # starts that are scored, and then tried, at once
ACTS, ZOOMS = 1e-3, 2  # [std] by which an effect shows at all; rounds that find where
WITHIN = (1e-3, 0.3)  # how far within the threshold half of the fits begin, as shares of it
DEEP = (0.6, 0.05)  # of it, from which the others begin: one stray sample may set the threshold
LITTLE = 0.05  # factor of a start whose size would turn its sign
SHY = (0.0, 0.125, 0.4)  # of the way, on a logarithmic scale, to where a start would grow


def row_of(problem: Problem, u: Array, instance: Instance, values: Mapping[str, float]) -> Array:
    """The internal vector with the parameters of one effect set; ``name@run`` goes before name."""
    row, prefix = u.copy(), f"{instance.effect.name}.{instance.location}."
    for k, unknown in enumerate(problem.unknowns):
        name = unknown.key.removeprefix(prefix)
        if name != unknown.key:
            row[k] = unknown.internal(values.get(name, values[name.partition("@")[0]]))
    return row


def changes(base: Fit, problem: Problem, vectors: Array) -> Steps[Array]:
    """Change of the residual (sets, samples) by each vector; 0 where it breaks down."""
    count = problem.parts[-1].stop
    change = yield from residuals(problem, vectors)
    with np.errstate(over="ignore", invalid="ignore"):
        change -= base.residual[:count]
        whole = np.einsum("ij,ij->i", change, change) < BROKEN**2
    change[~whole] = 0.0
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
) -> Steps[tuple[float, ...]]:
    """Sizes (TRIED,) just within the threshold of an effect on these data, and far below it."""
    size = instance.effect.size
    others = {p.name: p.starts[0] for p in instance.effect.parameters}
    tried = np.array(sorted(size.starts))
    for _ in range(1 + ZOOMS):
        rows = [others | {size.name: v} for v in tried]
        vectors = np.array([row_of(problem, u, instance, row) for row in rows])
        acts = np.abs((yield from changes(base, problem, vectors))).max(axis=1) > ACTS
        last = int(np.flatnonzero(acts).max(initial=0))
        tried = np.geomspace(tried[last], tried[min(last + 1, len(tried) - 1)], TRIED)
    half = TRIED // 2
    near, far = 1 - np.geomspace(*WITHIN, half), np.geomspace(*DEEP, half)
    return tuple((tried[0] * np.concatenate([near, far])).tolist())


def spare_of(gram: Array) -> float:
    """Factor by which the faintest of several signatures may grow and not be told, at 95 %."""
    return 1.645 / max(float(np.sqrt(np.diag(gram).min())), 1e-9)


@dataclass(frozen=True)
class Score:
    """One start (of those that differ by a phase the first): its linear gain [nats], its grown
    values, the largest factor at 95 %, and its own values.
    """

    gain: float
    values: Mapping[str, float]
    bound: float
    row: Mapping[str, float]


def grown_by(
    instance: Instance, rows: list[dict[str, float]], factors: Array
) -> tuple[float, dict[str, float] | None]:
    """Factor of a start, or of several that differ by their phase alone, and its values so grown;
    none where the size would turn its sign and has none.
    """
    phase, size = phase_of(instance), instance.effect.size
    if phase is not None and len(rows) > 1:
        factor, angle = combined(rows, factors, phase)
        return factor, grown(instance, {**rows[0], phase.name: angle}, max(factor, 0.02))
    factor = float(factors[0])
    if size.lower >= 0 and factor <= 0 and len(instance.effect.sizes) == 1:
        return factor, None
    return factor, grown(instance, rows[0], factor)


def _scored(
    instance: Instance, rows: list[dict[str, float]], products: Array, gram: Array
) -> Score:
    """The score of one start, or of several that differ by their phase alone (`Beyond.of`)."""
    if len(rows) > 1 and phase_of(instance) is not None:
        gain, factors = gain_many(products, gram)
    else:
        gain, single = gain_one(float(products[0]), float(gram[0, 0]))
        factors = np.array([single])
    factor, values = grown_by(instance, rows, factors)
    if values is None:
        gain, values = 0.0, grown(instance, rows[0], LITTLE)
    return Score(gain, values, abs(factor) + spare_of(gram), rows[0])


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


def score_of(
    beyond: Beyond, problem: Problem, instance: Instance, u: Array, values: Mapping[str, float]
) -> Steps[Score]:
    """The score of an effect with these values, of a wave at any phase, retuning once."""
    phase = phase_of(instance)
    rows = [{**values, phase.name: start} for start in phase.starts] if phase else [dict(values)]
    vectors = np.array([row_of(problem, u, instance, row) for row in rows])
    seen = beyond.of((yield from _given_way(beyond, problem, vectors)), slice(None))
    return _scored(instance, rows, *seen)


def _given_way(beyond: Beyond, problem: Problem, vectors: Array) -> Steps[Array]:
    """Changes (sets, samples + size) by vectors (sets, size), the machine retuned to each by one
    step of Gauss-Newton: where it hides nearly all, what bends is as large as what is left.
    """
    own, moved = beyond.fit.problem, vectors.copy()
    places = [problem.keys.index(key) for key in own.keys]
    moved[:, places] += beyond.given_way((yield from changes(beyond.fit, problem, vectors)))
    moved = np.clip(moved, *problem.limits())
    priors = (moved - vectors)[:, places] * own.prior[1]
    return np.hstack([(yield from changes(beyond.fit, problem, moved)), priors])


def scores(
    beyond: Beyond, problem: Problem, instance: Instance, u: Array, offered: Spread
) -> Steps[list[Score]]:
    """Scores of all starts, best first; a few blocks of lanes at a time, to spare memory."""
    rows = combinations(instance, offered)
    together, found = groups(instance, rows), []
    share = max(TRIED // len(together[0]), 1)
    for first in range(0, len(together), share):
        block = [n for group in together[first : first + share] for n in group]
        vectors = np.array([row_of(problem, u, instance, rows[n]) for n in block])
        products, gram = beyond.of((yield from changes(beyond.fit, problem, vectors)))
        for group in together[first : first + share]:
            own = [block.index(n) for n in group]
            seen = products[own], gram[np.ix_(own, own)]
            found.append(_scored(instance, [rows[n] for n in group], *seen))
            found += _shy(instance, rows[group[0]], found[-1])
    return sorted(found, key=lambda score: -score.gain)
