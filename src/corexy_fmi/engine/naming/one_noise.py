"""Noise is the same whatever is assumed to be missing.

Each fit is settled under the noise of its own residuals.  What it leaves slowly can pass for colour
there and costs it nothing, where the sensor resolves so finely that sample to sample all fits are
alike.  So where fits that are about as good leave errors of very different size, the smaller ones
are the noise, and all are fitted again under that.  And no cause takes more for noise than nothing
does.
"""

from __future__ import annotations

from dataclasses import replace

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise
from corexy_fmi.engine.fitting.noise import size
from corexy_fmi.engine.fitting.quiet import LOUDER
from corexy_fmi.engine.naming.entries import THRESHOLD, Entry, entry_of
from corexy_fmi.engine.naming.search import LONG, PLAIN, margin

MORE = 1.05  # times what a fit of nothing takes for noise


def under_one_noise(
    base: Fit, entries: list[Entry], mapper: Mapper, held: bool = False
) -> tuple[Fit, list[Entry]]:
    """The retuned machine and the entries, best first, under the noise of the quietest of those
    that another noise may put first (`search.margin`), where another of those is louder than noise
    may differ, or they were ``held`` to a noise (`quietest.py`); as they are anywhere else.
    """
    entries = _no_louder(base, entries, mapper)
    least = max(entries[0].gain - margin(entries[0].gain), THRESHOLD) if entries else 0.0
    near = [e.fit for e in entries if e.gain > least]
    sizes = [_size(fit) for fit in near]
    if not near or (not held and max(sizes) < LOUDER * min(sizes)):
        return base, entries
    quiet = min(near, key=_size)
    noise = quiet.problem.noise

    def again(fit: Fit) -> Fit:
        return minimise(replace(fit.problem, noise=noise), fit.u, LONG, PLAIN)

    retuned = again(base)
    other = again(replace(base, u=base.problem.carried(quiet.problem, quiet.u)))
    retuned = min(retuned, other, key=lambda fit: fit.cost)
    fits = mapper(again, [e.fit for e in entries])
    return retuned, sorted((entry_of(retuned, f) for f in fits), key=lambda e: -e.gain)


def _no_louder(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries, best first, those that take more for noise than nothing does under the noise of
    that: what makes one recording worse, so that another may be as loud, gains nothing.
    """
    loud = [e for e in entries if _size(e.fit) > MORE * _size(base)]

    def again(entry: Entry) -> Entry:
        problem = replace(entry.fit.problem, noise=base.problem.noise)
        return entry_of(base, minimise(problem, entry.fit.u, LONG, PLAIN))

    found = {id(e): e for e in entries} | dict(zip(map(id, loud), mapper(again, loud), strict=True))
    return sorted((found[id(e)] for e in entries), key=lambda e: -e.gain)


def _size(fit: Fit) -> float:
    return size(fit.problem.noise)
