"""Name: every hypothesis is fitted as hard as the retuned machine, and they compete.

A search (`search.py`) gives the best single causes.  Then a second effect may join, if it pays, and
the leaders are fitted again from beside their ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.rough import softened
from corexy_fmi.engine.naming.again import (
    begun_in_balance,
    by_parity,
    matched,
    recentred,
    refined,
    repolish,
)
from corexy_fmi.engine.naming.bold import bold_fits
from corexy_fmi.engine.naming.candidates import hypotheses
from corexy_fmi.engine.naming.clean_again import without_more_spikes
from corexy_fmi.engine.naming.elsewhere import elsewhere
from corexy_fmi.engine.naming.entries import (
    THRESHOLD,
    Competition,
    Entry,
    catalogue_first,
    joined,
    ranked,
    shed,
    without_idle,
)
from corexy_fmi.engine.naming.forms import at_forms
from corexy_fmi.engine.naming.jointly import jointly
from corexy_fmi.engine.naming.kindred import kindred, with_kindred
from corexy_fmi.engine.naming.leaders import leaders
from corexy_fmi.engine.naming.one_noise import under_one_noise
from corexy_fmi.engine.naming.overtones import overtone_fits
from corexy_fmi.engine.naming.pairs import pairs, paying
from corexy_fmi.engine.naming.pulses import pulse_fits
from corexy_fmi.engine.naming.quietest import contenders, under_ceiling
from corexy_fmi.engine.naming.search import CLOSE, FINALISTS, margin, once, rank, search
from corexy_fmi.engine.naming.specification import leftover
from corexy_fmi.engine.naming.swinging import swinging
from corexy_fmi.engine.naming.whole import with_whole_counts


def _told_by_parity(entries: list[Entry]) -> list[Entry]:
    """The entries with a law that won as half of it, where that suffices; what it gains, by which
    it won, stays as it was.
    """
    if not entries or not entries[0].hypothesis.law:
        return entries
    fit = by_parity(entries[0].fit)
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


def _softened(entries: list[Entry]) -> list[Entry]:
    """The entries, the first with slopes that bends and steps do not hide: by thousandths a dead
    band has none.  It comes last, for a fit begun again has slopes of its own.
    """
    return [replace(e, fit=softened(e.fit)) for e in entries[:1]] + entries[1:]


def laws_once(fits: list[Fit]) -> list[Fit]:
    """The fits, each law once, from the end with less raw mismatch: each has a noise of its own."""
    return [
        *(f for f in fits if not f.problem.hypothesis.law),
        *once([f for f in fits if f.problem.hypothesis.law]),
    ]


def _ahead(base: Fit, fits: list[Fit]) -> list[Fit]:
    """Fits that something is explained by, and hardly less than by the best of them."""
    if not fits:
        return []
    first = rank(fits[0])
    least = min(first + margin(base.cost - first), base.cost - THRESHOLD)
    return [f for f in fits if rank(f) < least]


def _balanced(base: Fit, fits: list[Fit], mapper: Mapper) -> list[Fit]:
    """The fits, best first, those that gain a fair share begun again in balance."""
    able = contenders(base, fits)
    again = dict(zip(map(id, able), mapper(begun_in_balance, able), strict=True))
    return sorted((again.get(id(f), f) for f in fits), key=rank)


def _wants_more(base: Fit, fits: list[Fit]) -> bool:
    """Whether no effect explains anything, or the best one leaves what stands out."""
    gain = base.cost - rank(fits[0]) if fits else 0.0
    if gain < THRESHOLD or fits[0].problem.hypothesis.law:
        return True
    return leftover(fits[0]).matters(gain)


def compete(
    base: Fit,
    mapper: Mapper,
    tell: Callable[[str], None] = lambda text: None,
    without: frozenset[str] = frozenset(),
) -> Competition:
    """Let every hypothesis compete on top of the retuned machine (already settled)."""
    own = base.problem.noise
    base = replace(base, problem=replace(base.problem, ceiling=own))
    singles = hypotheses(base.problem, base.u, without)
    tell("fitting every effect at every place")
    fits = search(base, singles, mapper, FINALISTS)
    fits = sorted([*fits, *kindred(_ahead(base, fits), singles, mapper)], key=rank)
    fits = sorted([*fits, *pulse_fits(base, singles, mapper)], key=rank)
    fits = sorted([*fits, *overtone_fits(base, fits, mapper)], key=rank)
    if _wants_more(base, fits):
        fits = sorted(laws_once([*fits, *bold_fits(base, singles, mapper)]), key=rank)
    base, fits = swinging(base, _balanced(base, fits, mapper), mapper)
    fits = with_whole_counts(fits, mapper)
    base, fits = under_ceiling(base, fits, mapper)
    fits[:1] = [recentred(f, mapper) for f in fits[:1]]
    base = repolish(base, fits[0]) if fits else base
    fits[:1] = [refined(f) for f in fits[:1]]
    tell("looking for a second effect")
    base, sets = pairs(base, fits, singles, mapper)
    sets += paying(jointly(base, [*sets, *fits], singles, mapper), fits, base, mapper)
    entries = joined(base, [], [*sets, *fits])
    entries = leaders(base, elsewhere(base, entries, singles, mapper), mapper)
    entries = shed(base, entries, mapper)
    entries = with_kindred(base, entries, singles, mapper)
    base, entries = matched(*without_more_spikes(base, entries, mapper))
    base, entries = under_one_noise(base, entries, mapper, base.problem.ceiling is not own)
    entries = without_idle(at_forms(entries, mapper))
    entries = _told_by_parity(catalogue_first(_against_sets(entries)))
    return ranked(softened(base), _softened(entries))
