"""Name: every hypothesis is fitted as hard as the retuned machine, and they compete.

A search (`search.py`) gives the best single causes.  Then a second effect may join, if it pays, and
the leaders are fitted again from beside their ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from corexy_fmi.engine.again import (
    by_parity,
    leaders,
    matched,
    polished,
    recentred,
    refined,
    repolish,
)
from corexy_fmi.engine.bold import bold_fits
from corexy_fmi.engine.candidates import hypotheses
from corexy_fmi.engine.elsewhere import elsewhere
from corexy_fmi.engine.entries import (
    THRESHOLD,
    Competition,
    Entry,
    catalogue_first,
    entry_of,
    form_floor,
    ranked,
    without_idle,
)
from corexy_fmi.engine.fit import Fit, Mapper
from corexy_fmi.engine.one_noise import under_one_noise
from corexy_fmi.engine.overtones import alone, overtone_fits
from corexy_fmi.engine.pulses import pulse_fits
from corexy_fmi.engine.resolution import at_resolution
from corexy_fmi.engine.rough import softened
from corexy_fmi.engine.search import CLOSE, FINALISTS, rank, search
from corexy_fmi.engine.specification import leftover
from corexy_fmi.engine.unknowns import Hypothesis
from corexy_fmi.engine.whole import whole, with_whole_counts

SECOND_SHARE = 0.04  # a second effect gains at least this share of the first one's gain
COMPLETING = 0.005  # the same where the first one alone is refuted by what it leaves, both are not
WHOLE = 3.0  # standard deviations of what both leave to simple functions, at most


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


def _pairs(base: Fit, fits: list[Fit], singles: list[Hypothesis], mapper: Mapper) -> list[Fit]:
    """Second effects on top of the best catalogued fit, and a check of the first one."""
    named = [f for f in fits if f.problem.hypothesis.uses]
    if not named or base.cost - rank(named[0]) < THRESHOLD or at_resolution(named[0]):
        return []
    found = search(named[0], _extended(named[0], singles), mapper, 3, THRESHOLD)[:3]
    if not found:
        return []
    pulses = overtone_fits(named[0], found, mapper)
    fits += map(alone, pulses)
    found = sorted([*mapper(whole, found), *pulses], key=rank)
    single = polished(named[0], found[0])
    fits[fits.index(named[0])] = named[0] = single
    added = found[0].problem.hypothesis.uses[-1]
    other = next((f for f in fits if f.problem.hypothesis.uses == (added,)), None)
    if other is not None and _pays(named[0], found[0], base):
        tried = {f.problem.hypothesis.key for f in fits}  # what the first round thought worth a fit
        others = [s for s in singles if s.key in tried]
        found += mapper(whole, search(other, _extended(other, others), mapper, 2, THRESHOLD)[:2])
    return [f for f in found if all(_pays(one, f, base) for one in _parts(f, fits))]


def _parts(two: Fit, fits: list[Fit]) -> list[Fit]:
    """The best catalogued fit, and those of either of a pair's effects alone."""
    named = [f for f in fits if f.problem.hypothesis.uses]
    own = [(use,) for use in two.problem.hypothesis.uses]
    return named[:1] + [f for f in named if f.problem.hypothesis.uses in own]


def _pays(one: Fit, two: Fit, base: Fit) -> bool:
    """Whether a second effect gains enough over one: as a wrong form of one may leave a share of it
    to others, either more than that, or what one leaves to simple functions and both do not.
    """
    gain, whole = rank(one) - rank(two), base.cost - one.cost
    if gain < max(THRESHOLD + form_floor(two), COMPLETING * whole):
        return False
    return gain > SECOND_SHARE * whole or (
        leftover(one).matters(0.0) and leftover(two).score < WHOLE
    )


def _told_by_parity(entries: list[Entry]) -> list[Entry]:
    """The entries with a law that won as half of it, where that suffices; what it gains, by which
    it won, stays as it was.
    """
    if not entries or not entries[0].hypothesis.law:
        return entries
    fit = softened(by_parity(entries[0].fit))
    return [replace(entries[0], hypothesis=fit.problem.hypothesis, fit=fit), *entries[1:]]


def _against_sets(entries: list[Entry]) -> list[Entry]:
    """Where a set of several effects is the best named, the laws close to it by parity, with what
    that gains: one law that is as good as two effects is the simpler cause.
    """
    named = next((e for e in entries if e.hypothesis.uses), None)
    if named is None or len(named.hypothesis.uses) < 2:
        return entries
    least = named.gain - CLOSE
    told = [_halved(e) if e.hypothesis.law and e.gain > least else e for e in entries]
    return sorted(told, key=lambda e: -e.gain)


def _halved(entry: Entry) -> Entry:
    fit = by_parity(entry.fit)
    return Entry(fit.problem.hypothesis, fit, entry.gain + rank(entry.fit) - rank(fit))


def compete(
    base: Fit,
    mapper: Mapper,
    tell: Callable[[str], None] = lambda text: None,
    without: frozenset[str] = frozenset(),
) -> Competition:
    """Let every hypothesis compete on top of the retuned machine (already settled)."""
    singles = hypotheses(base.problem, base.u, without)
    tell("fitting every effect at every place")
    fits = search(base, singles, mapper, FINALISTS)
    fits = sorted([*fits, *pulse_fits(base, singles, mapper)], key=rank)
    fits = sorted([*fits, *overtone_fits(base, fits, mapper)], key=rank)
    if not fits or base.cost - rank(fits[0]) < THRESHOLD or fits[0].problem.hypothesis.law:
        fits = sorted([*fits, *bold_fits(base, singles, mapper)], key=rank)
    fits = with_whole_counts(fits, mapper)
    fits[:1] = [recentred(f, mapper) for f in fits[:1]]
    base = repolish(base, fits[0]) if fits else base
    fits[:1] = [refined(f) for f in fits[:1]]
    tell("looking for a second effect")
    pairs = _pairs(base, fits, singles, mapper)
    unique: dict[tuple[tuple[str, str], ...], Entry] = {}
    for fit in [*pairs, *fits]:
        entry = entry_of(base, fit)
        held = unique.get(entry.hypothesis.key)
        if held is None or entry.gain > held.gain:
            unique[entry.hypothesis.key] = entry
    entries = sorted(unique.values(), key=lambda e: -e.gain)
    entries = leaders(base, elsewhere(base, entries, singles, mapper), mapper)
    base, entries = under_one_noise(*matched(base, entries), mapper)
    entries = _told_by_parity(catalogue_first(_against_sets(without_idle(entries))))
    return ranked(base, entries)
