"""Two causes that only show together: a rotation and a skew that cancel along one axis.

Neither gains alone, so no search begins with one of them.  Where the best that was found leaves
something over, the signatures of all single causes at the retuned machine are regressed on its
residual two by two, and what promises more than was found is fitted.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle_no_dearer
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.rough import HEAVY
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.abreast import Steps, in_companies
from corexy_fmi.engine.naming.beyond import Beyond, beyond
from corexy_fmi.engine.naming.entries import THRESHOLD
from corexy_fmi.engine.naming.screen import by_one_run, every_start
from corexy_fmi.engine.naming.search import SHORT, long_fit, penalty, rank, samples_of
from corexy_fmi.engine.naming.signature import changes, gain_many, grown_by, row_of
from corexy_fmi.engine.naming.specification import leftover
from corexy_fmi.engine.naming.spread import Spread, phase_of, spread
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

TRIED, GOING = 8, 2  # pairs that are fitted shortly, and to their end
APART = 0.02  # share of its own square that a signature keeps beyond the other


@dataclass(frozen=True, eq=False)
class Signature:
    """What the best start of a single cause, a wave's in each phase, changes: (rows, samples);
    ``price`` [nats] of its parameters.
    """

    instance: Instance
    rows: list[dict[str, float]]
    change: Array
    price: float


def jointly(
    base: Fit, found: Sequence[Fit], singles: list[Hypothesis], mapper: Mapper
) -> list[Fit]:
    """Settled fits of pairs that promise more than the best named cause, where that leaves some."""
    named = min([base, *(f for f in found if f.problem.hypothesis.uses)], key=rank)
    if samples_of(base) > HEAVY or _suffices(named, base, found):
        return []
    least = base.cost - rank(named) + THRESHOLD
    starts = _promising(base, _signatures(base, singles, mapper), least)
    shorts = sorted(mapper(lambda start: minimise(start[0], start[1], SHORT), starts), key=rank)
    return list(mapper(lambda fit: settle_no_dearer(long_fit(fit)), shorts[:GOING]))


def _suffices(named: Fit, base: Fit, found: Sequence[Fit]) -> bool:
    """Whether a fit leaves nothing over, and no law without a name gains more."""
    laws = [rank(f) for f in found if f.problem.hypothesis.law]
    behind = rank(named) - min(laws, default=np.inf)
    return behind < THRESHOLD and not leftover(named).matters(base.cost - named.cost)


def _signatures(base: Fit, singles: list[Hypothesis], mapper: Mapper) -> list[Signature]:
    behind, offered = beyond(base), spread(base)
    known = [s for s in singles if len(s.uses) == 1 and _tells(s.uses[0])]
    problems = [replace(base.problem, hypothesis=s) for s in known]
    return in_companies(lambda p: _signature(behind, p, offered), problems, mapper)


def _tells(instance: Instance) -> bool:
    """Whether a linear signature says anything of a cause beside others."""
    return not by_one_run(instance) and not instance.effect.frees_rotor


def _signature(behind: Beyond, problem: Problem, offered: Spread) -> Steps[Signature]:
    instance = problem.hypothesis.uses[-1]
    u = problem.carried(behind.fit.problem, behind.fit.u)
    row = dict((yield from every_start(behind, problem, instance, offered))[0].row)
    phase = phase_of(instance)
    rows = [{**row, phase.name: start} for start in phase.starts] if phase else [row]
    vectors = np.array([row_of(problem, u, instance, r) for r in rows])
    change = yield from changes(behind.fit, problem, vectors)
    return Signature(instance, rows, change, penalty(problem, samples_of(behind.fit)))


def _promising(base: Fit, seen: list[Signature], least: float) -> list[tuple[Problem, Array]]:
    """Pairs that gain ``least`` nats linearly, price paid, each with its start, the best first."""
    if not seen:
        return []
    products, gram = beyond(base).of(np.vstack([s.change for s in seen]))
    ends = np.cumsum([len(s.rows) for s in seen])
    places = [list(range(end - len(s.rows), end)) for end, s in zip(ends, seen, strict=True)]
    offered = []
    for one, two in itertools.combinations(range(len(seen)), 2):
        both = [*places[one], *places[two]]
        if seen[one].instance.effect.name == seen[two].instance.effect.name:
            continue
        gain, factors = gain_many(products[both], gram[np.ix_(both, both)])
        gain -= seen[one].price + seen[two].price
        if gain > least and _apart(gram, places[one], places[two]):
            offered.append((gain, seen[one], seen[two], factors))
    offered.sort(key=lambda pair: -pair[0])
    starts = (_start(base, *pair[1:]) for pair in offered)
    return list(itertools.islice((s for s in starts if s is not None), TRIED))


def _apart(gram: Array, one: list[int], two: list[int]) -> bool:
    """Whether neither is a multiple of the other, whose difference would be anything."""
    cross, own = gram[np.ix_(one, two)], gram[np.ix_(one, one)]
    square = np.diag(gram)[two]
    shared = np.sum(cross * np.linalg.lstsq(own, cross, rcond=1e-9)[0], axis=0)
    return bool(np.all(square - shared > APART * square))


def _start(
    base: Fit, one: Signature, two: Signature, factors: Array
) -> tuple[Problem, Array] | None:
    """The problem of both and where its fit begins; None where a size would turn its sign."""
    problem = replace(base.problem, hypothesis=Hypothesis((one.instance, two.instance)))
    u, count = problem.carried(base.problem, base.u), len(one.rows)
    for signature, own in ((one, factors[:count]), (two, factors[count:])):
        _, values = grown_by(signature.instance, signature.rows, own)
        if values is None:
            return None
        u = row_of(problem, u, signature.instance, values)
    return problem, np.clip(u, *problem.limits())
