"""Causes that bring the same spring of a rotor, each begun where the other ended.

A detent is seen through the field that it stands beside: as long as that is stiffer than it is, its
signature promises nothing, and no short fit finds both.  Where a soft field alone explains
something, the same field with detents is begun from there.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.restart import best
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.beyond import beyond
from corexy_fmi.engine.naming.entries import Entry, joined
from corexy_fmi.engine.naming.search import SHORT, long_fit, rank
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

TIMES = (0.3, 1.0, 3.0)  # of a size's start
TRIED = 4  # starts that are fitted


def kindred(fits: Sequence[Fit], singles: Sequence[Hypothesis], mapper: Mapper) -> list[Fit]:
    """Settled fits of the best fit that frees a rotor, with each other effect that does among
    ``singles`` in its place; none where no fit does.
    """
    freed = [f for f in fits if _rotor(f.problem.hypothesis)]
    if not freed:
        return []
    first = min(freed, key=rank)
    own = _rotor(first.problem.hypothesis)[0]
    others = [i for s in singles for i in _rotor(s) if i.effect.name != own.effect.name]
    return [_begun(first, own, i, mapper) for i in others if i.location == own.location]


def with_kindred(
    base: Fit, entries: list[Entry], singles: Sequence[Hypothesis], mapper: Mapper
) -> list[Entry]:
    """The entries, best first, with what else frees a rotor begun once more where their first named
    one ended: detents that do nothing may have shown the way to a field that does all alone.
    """
    first = next((e for e in entries if e.hypothesis.uses), None)
    if first is None or first.gain <= 0:
        return entries
    return joined(base, entries, kindred([first.fit], singles, mapper))


def _rotor(hypothesis: Hypothesis) -> list[Instance]:
    """What frees a rotor among a hypothesis' effects."""
    return [i for i in hypothesis.uses if i.effect.frees_rotor]


def _begun(first: Fit, own: Instance, other: Instance, mapper: Mapper) -> Fit:
    """The fit with another effect in the place of its own, which keeps what both have."""
    old = first.problem.hypothesis
    uses = tuple(other if i is own else i for i in old.uses)
    problem = replace(first.problem, hypothesis=replace(old, uses=uses))
    starts = _starts(problem, first, own, other)
    samples = len(first.residual) - first.problem.size
    gains = beyond(first).gains(problem.residual(starts)[:, :samples])
    order = np.argsort(-gains, kind="stable")[:TRIED]
    shorts = list(mapper(lambda u: minimise(problem, u, SHORT), starts[order]))
    return settle(long_fit(best(shorts)))


def _starts(problem: Problem, first: Fit, own: Instance, other: Instance) -> Array:
    """Where the fit ended (starts, size), with each start of what it had no value for."""
    before, now = (f"{i.effect.name}.{i.location}." for i in (own, other))
    places = {x.key: k for k, x in enumerate(problem.unknowns) if x.key.startswith(now)}
    offered = []
    for key, k in places.items():
        name = key.removeprefix(now)
        known = before + name in first.problem.keys
        values = [first.value(before + name)] if known else _offered(other, name)
        offered.append([problem.unknowns[k].internal(v) for v in values])
    rows = np.array(list(itertools.product(*offered)))
    starts = np.repeat(problem.carried(first.problem, first.u)[None], len(rows), axis=0)
    starts[:, list(places.values())] = rows
    return np.clip(starts, *problem.limits())


def _offered(instance: Instance, name: str) -> list[float]:
    parameter: Parameter = next(p for p in instance.effect.parameters if p.name == name)
    times = TIMES if parameter.size else (1.0,)
    return [t * start for start in parameter.starts for t in times]
