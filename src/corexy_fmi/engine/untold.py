"""How strong an effect may be and not be told: an upper bound from what its starts would change.

Each start says by how much it may grow (`signature.py`), as if all grew in proportion.  Many do
not: a dead band below some voltage does nothing.  So of starts that differ by their size alone the
largest one that is not told counts, up to the next one, which is.
"""

from __future__ import annotations

from collections.abc import Sequence

from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.signature import Score
from corexy_fmi.kernel.layout import Instance


def untold(instance: Instance, scores: Sequence[Score]) -> float:
    """Largest strength of an effect that is not told, at 95 %: of its size's distance from neutral,
    or of its inverse where the effect shrinks with that.
    """
    size = instance.effect.size
    shapes: dict[tuple[object, ...], dict[float, float]] = {}
    for score in scores:
        own = score.row[size.name]
        others = tuple(v for name, v in score.row.items() if name != size.name)
        kind = (own > size.neutral, others)
        shapes.setdefault(kind, {})[_strength(size, own)] = score.bound
    return max(_between(bounds) for bounds in shapes.values())


def _strength(size: Parameter, value: float) -> float:
    return 1 / value if size.scaling < 0 else abs(value - size.neutral)


def _between(bounds: dict[float, float]) -> float:
    """Where between starts the effect begins to be told; ``bounds``: by strength, factors."""
    known = sorted(bounds)
    hidden = [n for n, strength in enumerate(known) if bounds[strength] >= 1]
    last = hidden[-1] if hidden else 0
    return min(bounds[known[last]] * known[last], *known[last + 1 :], float("inf"))
