"""Second effects: what joins the best single cause, where that is more than a wrong form of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.resolution import at_resolution
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.again import polished, shaken
from corexy_fmi.engine.naming.entries import THRESHOLD
from corexy_fmi.engine.naming.kindred import kindred
from corexy_fmi.engine.naming.overtones import alone, overtone_fits
from corexy_fmi.engine.naming.quietest import held_to, quieter
from corexy_fmi.engine.naming.retimed import retimed
from corexy_fmi.engine.naming.search import CLOSE, rank, search
from corexy_fmi.engine.naming.specification import leftover
from corexy_fmi.engine.naming.whole import whole
from corexy_fmi.engine.naming.worth import COMPLETING, SECOND_SHARE, complete, gained, least, pays

ROUNDS = 2  # searches of what joins a first cause, at most
HOPELESS = 1 / 3  # of what a law gains: pairs that a search leaves below it are not gone on with


def _extended(first: Fit, singles: list[Hypothesis]) -> list[Hypothesis]:
    """The fit's effects with each other single candidate."""
    own = first.problem.hypothesis.uses
    names, free = {i.effect.name for i in own}, any(i.effect.frees_rotor for i in own)
    return [
        Hypothesis((*own, *s.uses), shaped=first.problem.hypothesis.shaped)
        for s in singles
        if s.uses
        and s.uses[0].effect.name not in names
        and not (s.uses[0].effect.frees_rotor and free)  # both would bring the same spring
    ]


def pairs(
    base: Fit, fits: list[Fit], singles: list[Hypothesis], mapper: Mapper
) -> tuple[Fit, list[Fit]]:
    """Second effects on top of the best catalogued fit, and a check of the first one; before them
    the retuned machine, under the ceiling that they set (`quietest.py`).

    Where that leaves something, what else is about as good has its turn, and so has a first one
    that a second led out of where it was stuck.
    """
    found: list[Fit] = []
    tried: dict[tuple[tuple[str, str], ...], float] = {}
    for _ in range(ROUNDS):
        one = _turn(base, fits, tried)
        if one is None or at_resolution(one):
            break
        tried[one.problem.hypothesis.key] = one.cost
        base, more = _joining(base, one, fits, singles, mapper)
        found = sorted([*found, *more], key=rank)
        if complete(found[0] if found else _named(fits)[0]):
            break
    return base, found


def _named(fits: Sequence[Fit]) -> list[Fit]:
    """Catalogued fits, best first."""
    return sorted((f for f in fits if f.problem.hypothesis.uses), key=rank)


def _turn(
    base: Fit, fits: Sequence[Fit], tried: Mapping[tuple[tuple[str, str], ...], float]
) -> Fit | None:
    """The best catalogued fit that explains something and was not tried, or is far better since;
    none that is far behind the best one.
    """
    named = [f for f in _named(fits) if base.cost - rank(f) >= THRESHOLD]
    near = [f for f in named if rank(f) < rank(named[0]) + CLOSE]
    lately = (tried.get(f.problem.hypothesis.key, np.inf) - f.cost for f in near)
    return next((f for f, gain in zip(near, lately, strict=True) if gain > CLOSE), None)


def _joining(
    base: Fit, one: Fit, fits: list[Fit], singles: list[Hypothesis], mapper: Mapper
) -> tuple[Fit, list[Fit]]:
    """Pairs of one of ``fits`` that pay; what they lead out of where it was stuck takes its place
    there.
    """
    found = search(one, _extended(one, singles), mapper, 3, THRESHOLD)[:3]
    if not found or _hopeless(found[0], fits, base):
        return base, []
    pulses = overtone_fits(one, found, mapper)
    fits += map(alone, pulses)
    found = [whole(_struck(two, singles, mapper)) for two in found]
    found = sorted([*found, *pulses, *kindred(found, singles, mapper)], key=rank)
    single = polished(one, found[0])
    fits[fits.index(one)] = single
    found[0] = _completed(single, found[0], base, mapper)
    quiet = quieter(single, found, COMPLETING * gained(single, base))
    if quiet is not None:
        base, fits[:], found = held_to(quiet, base, fits, found, mapper)
        single = next(
            f for f in fits if f.problem.hypothesis.uses == single.problem.hypothesis.uses
        )
    added = found[0].problem.hypothesis.uses[-1]
    other = next((f for f in fits if f.problem.hypothesis.uses == (added,)), None)
    if other is not None and pays(single, found[0], base):
        tried = {f.problem.hypothesis.key for f in fits}  # what the first round thought worth a fit
        others = [s for s in singles if s.key in tried]
        found += mapper(whole, search(other, _extended(other, others), mapper, 2, THRESHOLD)[:2])
    return base, paying(found, fits, base, mapper)


def _hopeless(two: Fit, fits: Sequence[Fit], base: Fit) -> bool:
    """Whether a law explains so much more than the best pair that nothing done to it would lead."""
    law = min((rank(f) for f in fits if f.problem.hypothesis.law), default=base.cost)
    return base.cost - rank(two) < HOPELESS * (base.cost - law)


def _struck(two: Fit, singles: Sequence[Hypothesis], mapper: Mapper) -> Fit:
    """A pair with its times found anew where it leaves something."""
    return two if complete(two) else retimed(two, singles, mapper)


def paying(found: list[Fit], fits: list[Fit], base: Fit, mapper: Mapper) -> list[Fit]:
    """The pairs that pay, also over their parts begun again where they ended."""
    first = [f for f in found if _pays_over_parts(f, fits, base)]
    for two in first:
        _begin_parts_again(two, fits, mapper)
    return [f for f in first if _pays_over_parts(f, fits, base)]


def _begin_parts_again(two: Fit, fits: list[Fit], mapper: Mapper) -> None:
    """Let those of ``fits`` that are either of a pair's effects alone begin where the pair ended: a
    second effect may have done no more than lead the first one out of where it was stuck.
    """
    own = _singles(two, fits)
    for one, again in zip(own, mapper(lambda one: polished(one, two), own), strict=True):
        fits[fits.index(one)] = again


def _pays_over_parts(two: Fit, fits: list[Fit], base: Fit) -> bool:
    return all(pays(one, two, base) for one in _parts(two, fits))


def _parts(two: Fit, fits: list[Fit]) -> list[Fit]:
    """The best catalogued fit, and those of either of a pair's effects alone."""
    named = _named(fits)
    return named[:1] + _singles(two, named)


def _singles(two: Fit, fits: list[Fit]) -> list[Fit]:
    """Fits of either of a pair's effects alone."""
    own = [(use,) for use in two.problem.hypothesis.uses]
    return [f for f in fits if f.problem.hypothesis.uses in own]


def _completed(one: Fit, two: Fit, base: Fit, mapper: Mapper) -> Fit:
    """A second effect that could do with its small share if both left nothing, begun again from
    beside its end: beside a strong one, a rotor on its field ended 170 nats short.
    """
    gain, first = rank(one) - rank(two), gained(one, base)
    small = least(one) * first < gain < SECOND_SHARE * first
    if not small or not leftover(one).matters(0.0) or complete(two):
        return two
    return shaken(two, mapper)
