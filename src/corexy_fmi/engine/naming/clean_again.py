"""Spikes that what was missing hid from the retuned machine, looked for beside the best cause.

One of eight standard deviations that stays, where an axis accelerates, passes for a law of that.
"""

from __future__ import annotations

from dataclasses import replace

from corexy_fmi.engine.fitting.clean import without_spikes
from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.naming.entries import THRESHOLD, Entry, entry_of
from corexy_fmi.engine.naming.search import CLOSE, LONG, PLAIN, samples_of


def without_more_spikes(base: Fit, entries: list[Entry], mapper: Mapper) -> tuple[Fit, list[Entry]]:
    """The retuned machine and the entries, best first, without the spikes that the best one shows;
    as they are where it shows none, or explains nothing.
    """
    if not entries or entries[0].gain < THRESHOLD:
        return base, entries
    runs = without_spikes(entries[0].fit)
    if sum(run.count for run in runs) == samples_of(base):
        return base, entries
    least = max(entries[0].gain - CLOSE, THRESHOLD)

    def again(fit: Fit, iterations: int = LONG) -> Fit:
        return minimise(replace(fit.problem, runs=runs), fit.u, iterations, PLAIN)

    retuned = settle(again(base))
    fits = mapper(lambda e: settle(again(e.fit)) if e.gain > least else again(e.fit, 0), entries)
    return retuned, sorted((entry_of(retuned, fit) for fit in fits), key=lambda e: -e.gain)
