"""Second effects: what joins the best single cause, where that is more than a wrong form of it."""

from __future__ import annotations

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.resolution import at_resolution
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.again import polished, shaken
from corexy_fmi.engine.naming.entries import THRESHOLD, form_floor
from corexy_fmi.engine.naming.kindred import kindred
from corexy_fmi.engine.naming.overtones import alone, overtone_fits
from corexy_fmi.engine.naming.search import rank, search
from corexy_fmi.engine.naming.specification import leftover
from corexy_fmi.engine.naming.whole import whole

SECOND_SHARE = 0.04  # a second effect gains at least this share of the first one's gain
COMPLETING = 0.005  # the same where the first one alone is refuted by what it leaves, both are not
WHOLE = 3.0  # standard deviations of what both leave to simple functions, at most
STARK = 10.0  # of what one alone leaves: no wrong form did, whatever share both gain


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


def pairs(base: Fit, fits: list[Fit], singles: list[Hypothesis], mapper: Mapper) -> list[Fit]:
    """Second effects on top of the best catalogued fit, and a check of the first one."""
    named = [f for f in fits if f.problem.hypothesis.uses]
    if not named or base.cost - rank(named[0]) < THRESHOLD or at_resolution(named[0]):
        return []
    found = search(named[0], _extended(named[0], singles), mapper, 3, THRESHOLD)[:3]
    if not found:
        return []
    pulses = overtone_fits(named[0], found, mapper)
    fits += map(alone, pulses)
    found = sorted([*mapper(whole, found), *pulses, *kindred(found, singles, mapper)], key=rank)
    single = polished(named[0], found[0])
    fits[fits.index(named[0])] = named[0] = single
    found[0] = _completed(single, found[0], base, mapper)
    added = found[0].problem.hypothesis.uses[-1]
    other = next((f for f in fits if f.problem.hypothesis.uses == (added,)), None)
    if other is not None and _pays(named[0], found[0], base):
        tried = {f.problem.hypothesis.key for f in fits}  # what the first round thought worth a fit
        others = [s for s in singles if s.key in tried]
        found += mapper(whole, search(other, _extended(other, others), mapper, 2, THRESHOLD)[:2])
    return paying(found, fits, base, mapper)


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
    return all(_pays(one, two, base) for one in _parts(two, fits))


def _parts(two: Fit, fits: list[Fit]) -> list[Fit]:
    """The best catalogued fit, and those of either of a pair's effects alone."""
    named = [f for f in fits if f.problem.hypothesis.uses]
    return named[:1] + _singles(two, named)


def _singles(two: Fit, fits: list[Fit]) -> list[Fit]:
    """Fits of either of a pair's effects alone."""
    own = [(use,) for use in two.problem.hypothesis.uses]
    return [f for f in fits if f.problem.hypothesis.uses in own]


def _pays(one: Fit, two: Fit, base: Fit) -> bool:
    """Whether a second effect gains enough over one: as a wrong form of one may leave a share of it
    to others, either more than that, or what one leaves to simple functions and both do not; any
    gain where that is stark.
    """
    gain, first = rank(one) - rank(two), base.cost - one.cost
    if gain < max(THRESHOLD + form_floor(two), _least(one) * first):
        return False
    return gain > SECOND_SHARE * first or (leftover(one).matters(0.0) and _complete(two))


def _least(one: Fit) -> float:
    """Share of one's gain that a second effect gains at least."""
    return 0.0 if leftover(one).score > STARK else COMPLETING


def _complete(fit: Fit) -> bool:
    return leftover(fit).score < WHOLE


def _completed(one: Fit, two: Fit, base: Fit, mapper: Mapper) -> Fit:
    """A second effect that could do with its small share if both left nothing, begun again from
    beside its end: beside a strong one, a rotor on its field ended 170 nats short.
    """
    gain, first = rank(one) - rank(two), base.cost - one.cost
    small = _least(one) * first < gain < SECOND_SHARE * first
    if not small or not leftover(one).matters(0.0) or _complete(two):
        return two
    return shaken(two, mapper)
