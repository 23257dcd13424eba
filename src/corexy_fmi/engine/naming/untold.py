"""How strong an effect may be and not be told: where its change is as large as noise lets pass.

Each start says by how much it may grow (`signature.py`), as if all grew in proportion.  Many do
not: a dead band below some voltage does nothing.  So of starts that differ by their size alone the
largest one that is not told counts, up to the next one, which is; of shapes, the one told least;
from there the size is searched at which an effect is just told.  Other shapes are asked at that
size: retuning hides more of what is weak, and what a strong start tells may be all but hidden.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.naming.abreast import Steps
from corexy_fmi.engine.naming.plan_size import Search, stronger
from corexy_fmi.engine.naming.signature import Score
from corexy_fmi.kernel.layout import Instance

ROUNDS, CLOSE = 6, 0.2  # sizes that are tried; log of the share by which the last may be off
SHAPES = 8  # those told least by their starts, that are asked at the size found
Values = Mapping[str, float]


def untold(
    instance: Instance,
    scores: Sequence[Score],
    again: Callable[[Values], Steps[Score]] | None = None,
) -> Steps[float]:
    """Largest strength of an effect that is not told, at 95 %: of its size's distance from neutral,
    or of its inverse where the effect shrinks with that.  ``again`` scores other values of it; None
    where its scores are as good as they get.
    """
    size = instance.effect.size
    shapes: dict[tuple[object, ...], list[Score]] = {}
    for score in scores:
        others = tuple(v for name, v in score.row.items() if name != size.name)
        shapes.setdefault((score.row[size.name] > size.neutral, others), []).append(score)
    ways = sorted((_between(size, group) for group in shapes.values()), key=lambda way: -way[0])
    allowed, row = ways[0]
    if again is None or not np.isfinite(allowed):
        return allowed
    found = yield from _searched(instance, allowed, row, again)
    if size.scaling < 0:
        return max(found, allowed)  # no step resolves what is stiffer
    for _, row in ways[1:SHAPES]:  # what starts say is told may be hidden, where it is as weak
        place = float(np.log(found / strength(size, row[size.name])))
        score = yield from again(stronger(instance, dict(row), place))
        if score.bound > 1:
            found = max(found, (yield from _searched(instance, found, row, again)))
    return found


def _searched(
    instance: Instance, allowed: float, row: Values, again: Callable[[Values], Steps[Score]]
) -> Steps[float]:
    """The strength at which an effect of one shape is just told, begun where it is allowed."""
    size = instance.effect.size
    begin = float(np.log(allowed / strength(size, row[size.name])))
    search = Search(begin, CLOSE, learns=True)
    place = search.place
    for _ in range(ROUNDS):
        place = search.place
        score = yield from again(stronger(instance, dict(row), place))
        if not search.goes_on(1 / score.bound):
            place = search.crossing
            break
    else:  # it jumps: from where on it is told
        place = search.above[0] if search.above else place
    return strength(size, stronger(instance, dict(row), place)[size.name])


def strength(size: Parameter, value: float) -> float:
    """How strong an effect is whose size has a value."""
    return 1 / value if size.scaling < 0 else abs(value - size.neutral)


def _between(size: Parameter, scores: Sequence[Score]) -> tuple[float, Values]:
    """Where between starts of one shape the effect begins to be told, and the start below."""
    known = sorted({strength(size, s.row[size.name]): s for s in scores}.items())
    ends = [*(above for above, _ in known[1:]), float("inf")]
    last = max((n for n, (_, score) in enumerate(known) if score.bound >= 1), default=0)
    own, score = known[last]
    return min(score.bound * own, ends[last]), score.row
