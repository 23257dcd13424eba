"""Shares between two laws of the literature: one of them is taken where the data do not tell.

A supply cuts sharply or has a knee, friction's peak is round or pointed; what lies between fits a
recording a little better, and another motion worse.  So a fit is begun again with its shares held
at each of the laws, and stays at the one that costs least where that is within what the data tell.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.restart import best
from corexy_fmi.engine.naming.entries import Entry
from corexy_fmi.engine.naming.search import CLOSE
from corexy_fmi.engine.naming.whole import held

UNTOLD = 1.92  # [nats] by which a likelihood falls at the end of one parameter's 95 % interval
MOST = 8  # sets of laws that are tried


def at_forms(entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """Entries, best first, those near the best of them at one of their laws where the data do not
    tell them from it; what that costs is not taken from what they gain.
    """
    near = [e for e in entries if e.gain > entries[0].gain - CLOSE]
    fits = mapper(at_form, [e.fit for e in near])
    moved = [_moved(e, fit) for e, fit in zip(near, fits, strict=True)]
    return sorted(moved + entries[len(near) :], key=lambda e: -e.gain)


def _moved(entry: Entry, fit: Fit) -> Entry:
    return replace(entry, fit=fit, gain=entry.gain + max(entry.fit.cost - fit.cost, 0.0))


def at_form(fit: Fit) -> Fit:
    """The fit at the laws that cost least, its shares as free as before, where that costs no more
    than `UNTOLD`; else as it is.
    """
    if not (shares := _shares(fit)):
        return fit
    sets = list(product(*shares.values()))[:MOST]
    there = best([held(fit, dict(zip(shares, values, strict=True))) for values in sets])
    return replace(there, problem=fit.problem) if there.cost < fit.cost + UNTOLD else fit


def _shares(fit: Fit) -> dict[str, tuple[float, ...]]:
    """Values of the laws of each share among the unknowns, by key."""
    known = {
        f"{i.effect.name}.{i.location}.{p.name}": p.forms
        for i in fit.problem.hypothesis.uses
        for p in i.effect.parameters
        if p.forms
    }
    return {key: known[key] for key in fit.problem.keys if key in known}
