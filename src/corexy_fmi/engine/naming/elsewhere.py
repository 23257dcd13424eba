"""The leading effect at the other places that share a part with its own: at one axis, at both; and
at those where it explains a fair share by itself: a motor's run-out and that of an idler near it.

Each is fitted from where the leader ended, besides its own search: what catches and lets go leaves
minima hundreds of nats apart, and a place that ended in a bad one is no rival that was beaten.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.entries import Entry, joined
from corexy_fmi.engine.naming.search import long_fit
from corexy_fmi.kernel.layout import Instance

ALIKE = 0.3  # share of the first one's gain that its effect has alone at another place


def elsewhere(
    base: Fit, entries: list[Entry], singles: Sequence[Hypothesis], mapper: Mapper
) -> list[Entry]:
    """The entries with the leader's effect at overlapping places begun again there, best first.

    Of a set of several each effect moves on its own; ``singles`` are the places that there are.
    """
    first = next((e for e in entries if e.hypothesis.uses), None)
    if first is None or first.gain <= 0:
        return entries
    alone = [e for e in entries if len(e.hypothesis.uses) == 1]
    able = {e.hypothesis.key[0] for e in alone if e.gain > ALIKE * first.gain}
    moved = _moved(first.hypothesis, singles, able)
    ends = mapper(lambda pair: _begun(first.fit, *pair), moved)
    return joined(base, entries, ends)


def _moved(
    leader: Hypothesis, singles: Sequence[Hypothesis], able: Set[tuple[str, str]]
) -> list[tuple[Hypothesis, dict[str, str]]]:
    """The leader with one of its effects at another place, that shares a part or is ``able``; what
    is that called, and was before.
    """
    found = []
    for n, own in enumerate(leader.uses):
        for other in (s.uses[0] for s in singles if len(s.uses) == 1):
            if _is_moved(own, other) and (
                _overlaps(own, other) or (other.effect.name, other.location) in able
            ):
                uses = (*leader.uses[:n], other, *leader.uses[n + 1 :])
                name = own.effect.name
                names = {f"{name}.{other.location}": f"{name}.{own.location}"}
                found.append((Hypothesis(uses, shaped=leader.shaped), names))
    return found


def _is_moved(one: Instance, other: Instance) -> bool:
    return one.effect.name == other.effect.name and one.location != other.location


def _overlaps(one: Instance, other: Instance) -> bool:
    return bool(set(one.places) & set(other.places))


def _begun(end: Fit, hypothesis: Hypothesis, names: dict[str, str]) -> Fit:
    """A hypothesis fitted from where the leader ended."""
    problem = replace(end.problem, hypothesis=hypothesis)
    known = dict(zip(end.problem.keys, end.u, strict=True))
    start = [known.get(key, known.get(_old(key, names), 0.0)) for key in problem.keys]
    return settle(long_fit(minimise(problem, np.array(start), 0)))


def _old(key: str, names: dict[str, str]) -> str:
    """What a key was called at the leader's place."""
    return next((key.replace(n, o, 1) for n, o in names.items() if key.startswith(f"{n}.")), key)
