"""Who leads is fitted again from beside its end; where it leaves something, others may lead."""

from __future__ import annotations

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.fitting.rough import across
from corexy_fmi.engine.naming.again import AGAIN, recentred, shaken
from corexy_fmi.engine.naming.entries import Entry, entry_of
from corexy_fmi.engine.naming.search import CLOSE, rank
from corexy_fmi.engine.naming.specification import leftover

LEADERS = 3  # entries fitted again
ELSEWHERE = 0.5  # share of the first one's gain that its effect has at another place, to go on
BEHIND, FAR_BEHIND = 6, 0.4  # entries that may be begun again; share of the first one's gain
RIVALS, NEARLY = 3, 0.9  # entries begun where the first one ended; share of its gain


def leaders(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries with those in the lead fitted again from beside their ends, best first."""
    entries = _from_the_first(base, _rescued(base, entries, mapper), mapper)
    named = [e for e in entries if e.hypothesis.uses]
    ahead = [e for e in named if _leads(e, named[0])]
    again = {id(e): entry_of(base, shaken(e.fit, mapper)) for e in ahead[:LEADERS] if e.gain > 0}
    return sorted((again.get(id(e), e) for e in entries), key=lambda e: -e.gain)


def _rescued(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries, where the best named one leaves something over with those not far behind it
    begun again around the machine file's nominal parameters: the truth may be one of them.
    """
    named = [e for e in entries if e.hypothesis.uses]
    if not named or not leftover(named[0].fit).matters(named[0].gain):
        return entries
    behind = [e for e in named[:BEHIND] if e.gain > FAR_BEHIND * named[0].gain]
    again = {id(e): entry_of(base, recentred(e.fit, mapper)) for e in behind}
    return sorted((again.get(id(e), e) for e in entries), key=lambda e: -e.gain)


def _from_the_first(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries, with those that gain nearly as much as the first named one, and yet are beaten,
    begun again where that ended: of what is strong a small part decides, and many minima are near.
    """
    named = [e for e in entries if e.hypothesis.uses]
    near = [e for e in named[1:] if NEARLY * named[0].gain < e.gain < named[0].gain - CLOSE]
    fits = list(mapper(lambda e: _begun(e.fit, named[0].fit), near[:RIVALS]))
    again = {id(e): entry_of(base, fit) for e, fit in zip(near, fits, strict=False)}
    return sorted((again.get(id(e), e) for e in entries), key=lambda e: -e.gain)


def _begun(fit: Fit, first: Fit) -> Fit:
    """The better of a fit and itself begun where another one ended, but for its own effects."""
    problem, shared = fit.problem, set(first.problem.keys)
    start = problem.carried(first.problem, first.u)
    own = [k for k, key in enumerate(problem.keys) if key not in shared]
    start[own] = fit.u[own]
    again = settle(across(minimise(problem, start, AGAIN)))
    return again if rank(again) < rank(fit) else fit


def _leads(entry: Entry, first: Entry) -> bool:
    """Whether an entry is close to the first, or is its effect at another place."""
    same = [n for n, _ in entry.hypothesis.key] == [n for n, _ in first.hypothesis.key]
    return entry.gain > first.gain - CLOSE or (same and entry.gain > ELSEWHERE * first.gain)
