"""Free-form laws that a place asks for: of a spot on an axis, of times that differ from one
recording to the next, and of what a winner leaves over.

A law over a whole axis has knots too far apart for a spot on a rail, a magnet beside it or a
dented belt's tooth.  So windows of narrow knots are tried all along the axis, and the best is
fitted.  And where a catalogued winner leaves something, the best law gets twice its knots: a rail
that is tight in several places is no one spot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.fitting.free_form import LawShape
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.again import by_parity, refined
from corexy_fmi.engine.naming.candidates import laws
from corexy_fmi.engine.naming.entries import (
    THRESHOLD,
    Competition,
    Entry,
    catalogue_first,
    entry_of,
    ranked,
)
from corexy_fmi.engine.naming.own_times import with_own_times
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.search import long_fit
from corexy_fmi.engine.naming.specification import leftover
from corexy_fmi.engine.places.probe_laws import FINE
from corexy_fmi.engine.places.site import Site, parts, remaining

ACROSS = 10  # knots of a window
NEAR = 0.5  # share of the winner's gain from which on a law is looked at more closely


def with_spot(competition: Competition, found: Sequence[Site], mapper: Mapper) -> Competition:
    """The competition with a law of a spot, where a place on an axis explains more than all that
    is in it.
    """
    first = next(iter(found), None)
    least = max([0.0, *(e.gain for e in competition.entries)]) + THRESHOLD
    if first is None or "position" not in first.states or first.gain <= least:
        return competition
    base = competition.retuned
    wide = [law for law in laws(base.problem, base.u) if law.location == law.argument]
    here = [law for law in wide if law.location in parts(first.location)]
    tried = [Hypothesis(law=window) for law in here for window in _windows(law)]
    if not tried:
        return competition
    entry = best_law(base, tried, mapper)
    if entry.gain <= least:
        return competition
    return ranked(base, catalogue_first([entry, *competition.entries]))


def with_times(competition: Competition, found: Sequence[Site], mapper: Mapper) -> Competition:
    """The competition with a law over time that has an onset in each recording, where a law of
    something else leads, and a place on an axis that time is said of explains about as much: one
    time for all hides what began at another in each.
    """
    first, best = next(iter(found), None), competition.best
    law = best.hypothesis.law if best else None
    if first is None or best is None or law is None or law.argument == "t":
        return competition
    if "time" not in first.states or first.gain < NEAR * best.gain:
        return competition
    base, here = competition.retuned, parts(first.location)
    tried = [
        Hypothesis(law=own)
        for own in laws(base.problem, base.u)
        if own.argument == "t" and own.location in here
    ]
    if not tried:
        return competition
    entry = entry_of(base, settle(with_own_times(best_law(base, tried, mapper).fit)))
    if entry.gain <= best.gain + THRESHOLD:
        return competition
    return ranked(base, catalogue_first([entry, *competition.entries]))


def with_finer(competition: Competition, beside: Sequence[Site] = ()) -> Competition:
    """The competition with its best law at twice the knots, odd or even where half of it suffices,
    if a catalogued winner leaves what simple functions of the motion, or laws of places ``beside``
    it, explain, and the law gains nearly as much.
    """
    first, base = competition.best, competition.retuned
    law = next((e for e in competition.entries if e.hypothesis.law), None)
    if first is None or first.hypothesis.law or law is None or law.gain < NEAR * first.gain:
        return competition
    if not (remaining(beside, first.gain) or leftover(first.fit).matters(first.gain)):
        return competition
    others = [e for e in competition.entries if e is not law]
    entries = sorted([entry_of(base, by_parity(refined(law.fit))), *others], key=lambda e: -e.gain)
    return ranked(base, catalogue_first(entries))


def best_law(base: Fit, tried: Sequence[Hypothesis], mapper: Mapper) -> Entry:
    """The law that promises most at a fit, fitted to the end."""
    lead = screen(base, list(tried), mapper)[0]
    return entry_of(base, settle(long_fit(minimise(lead.problem, lead.starts[0], 1))))


def _windows(law: LawShape) -> list[LawShape]:
    """Laws with knots as narrow as probes are, side by side along the range of a wide one."""
    step = (law.knots[-1] - law.knots[0]) / (FINE - 1)
    begins = law.knots[0] + step * np.arange(-ACROSS // 2, FINE - ACROSS // 2, 2)
    return [replace(law, knots=tuple((b + step * np.arange(ACROSS)).tolist())) for b in begins]
