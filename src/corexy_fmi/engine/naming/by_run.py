"""Scores of what belongs to one recording: each recording is scored alone.

A wave has one amplitude and a phase for each recording; its frequency is narrowed down around the
best ones, for where a guide sticks most of the time the spectrum shows it beside itself.  A jump
has a size and a time for each, the time narrowed down around the best start.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.naming.abreast import Steps
from corexy_fmi.engine.naming.beyond import Beyond
from corexy_fmi.engine.naming.signature import (
    TRIED,
    Score,
    changes,
    gain_many,
    gain_one,
    grown,
    row_of,
    spare_of,
)
from corexy_fmi.engine.naming.spread import Spread, combinations, combined, phase_of
from corexy_fmi.kernel.call import LANES, Array
from corexy_fmi.kernel.layout import Instance

NEARER, HEARD = 2, 15.0  # frequencies that are narrowed down; [nats] that each gains at least
WIDE, APART, MOST = 1.5, 0.5, 6  # waves of a run by which one may be off; between two; of them
ZOOMS, SHOWS = 2, 3.0  # rounds that narrow a time down; [nats] by which a run shows its own part


def by_run(
    beyond: Beyond, problem: Problem, instance: Instance, u: Array, offered: Spread
) -> Steps[list[Score]]:
    """Scores of an effect that has parameters of one recording, best first."""
    local = {p.name for p in instance.effect.parameters if p.local}
    shared: dict[tuple[float, ...], list[dict[str, float]]] = {}
    for row in combinations(instance, offered):
        shared.setdefault(tuple(v for n, v in row.items() if n not in local), []).append(row)
    score = _waves if phase_of(instance) else _jumps
    found = []
    for rows in shared.values():
        found.append(((yield from score(beyond, problem, instance, u, rows)), rows))
    tone = next((p.name for p in instance.effect.parameters if p.over == "frequency"), "")
    ahead = sorted(found, key=lambda one: -one[0].gain)[: NEARER if tone else 0]
    for best, rows in ahead:
        for frequency in _beside(problem, rows[0][tone]) if best.gain > HEARD else ():
            near = [{**row, tone: frequency} for row in rows]
            found.append(((yield from score(beyond, problem, instance, u, near)), near))
    return sorted((score for score, _ in found), key=lambda s: -s.gain)


def _beside(problem: Problem, frequency: float) -> list[float]:
    """Frequencies [Hz] around one that a spectrum shows, as far as its peak is wide."""
    lengths = [float(np.ptp(run.excitation.time)) for run in problem.runs]
    wide = WIDE / min(lengths)
    steps = min(int(np.ceil(wide * max(lengths) / APART)), MOST)
    offsets = np.linspace(-wide, wide, 2 * steps + 1)
    return [frequency + float(d) for d in offsets if d and frequency + d > 0]


def _waves(
    beyond: Beyond,
    problem: Problem,
    instance: Instance,
    u: Array,
    rows: list[dict[str, float]],
) -> Steps[Score]:
    """One amplitude, and a phase for each run."""
    phase = phase_of(instance)
    assert phase is not None
    vectors = np.array([row_of(problem, u, instance, r) for r in rows])
    change = yield from changes(beyond.fit, problem, vectors)
    values, sizes, gains, spare = dict(rows[0]), [], [], 0.0
    for run, part in zip(problem.runs, problem.parts, strict=True):
        products, gram = beyond.of(change[:, part], part)
        gain, factors = gain_many(products, gram)
        factor, values[f"{phase.name}@{run.name}"] = combined(rows, factors, phase)
        sizes.append(factor)
        gains.append(gain)
        spare = max(spare, spare_of(gram))
    size = float(np.average(sizes, weights=np.array(gains) + 1e-9))
    larger = grown(instance, values, max(size, 0.02))
    return Score(sum(gains), larger, size + spare, rows[0])


def _jumps(
    beyond: Beyond,
    problem: Problem,
    instance: Instance,
    u: Array,
    rows: list[dict[str, float]],
) -> Steps[Score]:
    """A size and a time for each run; the time is narrowed down around the best."""
    size = instance.effect.size
    timed = next(p.name for p in instance.effect.parameters if p.over == "time")
    times = sorted({row[timed] for row in rows})
    spacing = (times[-1] - times[0]) / max(len(times) - 1, 1)
    best = [(0.0, 0.0, rows[0][timed], 0.0)] * len(problem.runs)
    for _ in range(1 + ZOOMS):
        best = yield from _better(beyond, problem, instance, u, rows, timed, best)
        near = spacing * np.linspace(-1, 1, TRIED + 1)
        keys = [f"{timed}@{run.name}" for run in problem.runs]
        rows = [
            rows[0] | {k: b[2] + float(d) for k, b in zip(keys, best, strict=True)} for d in near
        ]
        spacing *= 2 / TRIED
    values = dict(rows[0])
    for run, (gain, factor, time, _) in zip(problem.runs, best, strict=True):
        larger = grown(instance, rows[0], factor)[size.name]
        values[f"{size.name}@{run.name}"] = larger if gain > SHOWS else size.neutral
        values[f"{timed}@{run.name}"] = time
    return Score(sum(b[0] for b in best), values, max(b[3] for b in best), rows[0])


def _better(
    beyond: Beyond,
    problem: Problem,
    instance: Instance,
    u: Array,
    rows: Sequence[dict[str, float]],
    timed: str,
    best: list[tuple[float, float, float, float]],
) -> Steps[list[tuple[float, float, float, float]]]:
    """Gain [nats], factor and time of the best row of each run, or what was best before; the
    largest bound, for a jump may be at whatever time.
    """
    found = list(best)
    for first in range(0, len(rows), LANES):
        block = rows[first : first + LANES]
        vectors = np.array([row_of(problem, u, instance, r) for r in block])
        change = yield from changes(beyond.fit, problem, vectors)
        for r, part in enumerate(problem.parts):
            key = f"{timed}@{problem.runs[r].name}"
            products, gram = beyond.of(change[:, part], part)
            for n, row in enumerate(block):
                gain, factor = gain_one(float(products[n]), float(gram[n, n]))
                bound = abs(factor) + spare_of(gram[n : n + 1, n : n + 1])
                ahead = (gain, factor, row.get(key, row[timed]))
                kept = ahead if gain > found[r][0] else found[r][:3]
                found[r] = (*kept, max(bound, found[r][3]))
    return found
