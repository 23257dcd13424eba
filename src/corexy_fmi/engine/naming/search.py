"""Search: the fits of one round, from a screen of all candidates to a few settled finalists.

A screen orders the candidates, a short fit of each thins them out, the best are fitted to the end
with the noise that their own residuals show.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.fitting.fit import (
    Fit,
    Mapper,
    costs,
    minimise,
    settle_no_dearer,
    white_noise,
)
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.rough import across
from corexy_fmi.engine.fitting.starts import starts
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.screen import Lead, screen

SHORT, FINALISTS, LAWS = 3, 6, 4
CLOSE, CLOSE_SHARE = 40.0, 0.25  # [nats]; share of the best one's gain: behind both all is lost
CONTENDS = 0.3  # share of the best short fit's gain that a finalist has
ALWAYS, LEAD_SHARE = 4, 0.02  # leads that are always fitted; share of the best lead's gain
PROMISING, OWED = 20.0, 0.5  # [nats] of a lead whose short fit must gain this share, or goes on
LONG, PLAIN = 8, 0.5  # iterations of a long fit; [nats] an iteration that gains less ends it
LEAST = 1.5  # [nats] that any other lead gains in the screen
BENDING = "velocity_reversal"  # the state of effects that a linear gain says little of


def penalty(problem: Problem, samples: int) -> float:
    """Half of the log of the sample count for each parameter beyond the nominal (BIC) [nats]."""
    count = len(problem.unknowns) - problem.nominal_count
    return 0.5 * count * float(np.log(max(samples, 2)))


def samples_of(fit: Fit) -> int:
    """Number of samples that a fit stands on."""
    return int(fit.problem.parts[-1].stop)


def rank(fit: Fit) -> float:
    """What orders fits: cost and penalty [nats], the less the better."""
    return fit.cost + penalty(fit.problem, samples_of(fit))


def _glance(lead: Lead) -> Fit:
    """One step from the lead's best start: enough to see who may win.

    It takes the nominal columns of the base's Jacobian for granted.
    """
    return minimise(lead.problem, lead.starts[0], 1, 0.5, lead.borrowed())


def _short(seen: tuple[Lead, Fit], top: float) -> Fit:
    """A short fit from the start that goes furthest in one iteration; a full one where it stays far
    behind what its lead promised, if that is as much as finalists have where ``top`` [nats] is had:
    stiffer belts must make room for a soft motor, which takes time.
    """
    lead, first = seen
    near = lead.borrowed()
    begun = [first, *(minimise(lead.problem, u, 1, 0.5, near) for u in lead.starts[1:])]
    best = min(begun, key=lambda f: f.cost)
    found = minimise(lead.problem, best.u, 1, 0.5, near, SHORT)
    promises = lead.gain > max(PROMISING, CONTENDS * top)
    owes = promises and lead.base.cost - found.cost < OWED * lead.gain
    return minimise(found.problem, found.u, LONG, PLAIN) if owes else found


def _hoped(lead: Lead, seen: Fit) -> float:
    """Nats that a lead may gain: one step may mislead where much moves at once."""
    return max(lead.base.cost - rank(seen), OWED * lead.gain)


def _shorts(leads: list[Lead], mapper: Mapper, count: int) -> list[Fit]:
    """Short fits of the ``count`` leads that are ahead after a glance and of those that bend, best
    first; then the others as seen.
    """
    seen = list(zip(leads, mapper(_glance, leads), strict=True))
    order = sorted(range(len(seen)), key=lambda n: (n >= ALWAYS, -_hoped(*seen[n])))
    ahead = [m < count or _bends(seen[n][0]) for m, n in enumerate(order)]
    fitted = [seen[n] for n, short in zip(order, ahead, strict=True) if short]
    left = [seen[n][1] for n, short in zip(order, ahead, strict=True) if not short]
    top = max((lead.base.cost - rank(fit) for lead, fit in seen), default=0.0)
    return sorted(mapper(lambda pair: _short(pair, top), fitted), key=rank) + left


def short_fits(leads: list[Lead], mapper: Mapper) -> list[Fit]:
    """A short fit of each lead, the best first."""
    return _shorts(leads, mapper, len(leads))


def _bends(lead: Lead) -> bool:
    """Whether one step tells little of a lead: what catches and lets go bends its own slopes."""
    return any(i.effect.state == BENDING for i in lead.hypothesis.uses[-1:])


def long_fit(fit: Fit) -> Fit:
    """A fit carried to its end, under the noise that it began with."""
    return across(minimise(fit.problem, fit.u, LONG, PLAIN))


def _thin(leads: list[Lead], floor: float) -> list[Lead]:
    """The catalogued leads worth a fit, and the best free-form laws.

    A lead is kept above ``floor`` nats and a share of the best one's gain; the first few always.
    """
    named = [lead for lead in leads if not lead.hypothesis.law]
    least = max(floor, LEAST, LEAD_SHARE * named[0].gain) if named else floor
    kept = [
        lead for n, lead in enumerate(named) if lead.gain >= least or (floor == 0 and n < ALWAYS)
    ]
    return kept + [lead for lead in leads if lead.hypothesis.law][:LAWS]


def search(
    base: Fit, candidates: list[Hypothesis], mapper: Mapper, finalists: int, floor: float = 0.0
) -> list[Fit]:
    """One round of competition on top of a fit; settled finalists, best first.

    Searched under the base's own noise and, where that is coloured, under white noise too: a slow
    mismatch can pass for colour, and is then invisible to a search that trusts the colour.  The
    first round also begins elsewhere (`starts.py`).
    """
    finals: list[Fit] = []
    rest: list[Fit] = []
    for start, tried, ahead in starts(base, candidates, floor == 0):
        leads = _thin(screen(start, tried, mapper), floor)
        shorts = _shorts(leads, mapper, ahead)
        going = _contenders(start, shorts[:finalists])
        ended = sorted(mapper(long_fit, going), key=rank)
        close = [f for f in ended if rank(f) - rank(ended[0]) < margin(start.cost - rank(ended[0]))]
        finals += close
        rest += ended[len(close) :] + shorts[len(going) :] if start is base else []
    noise = base.problem.noise
    settled = mapper(lambda fit: settle_no_dearer(fit, noise), once(finals))
    return sorted(settled, key=rank) + rest


def margin(gain: float) -> float:
    """Nats behind a best fit of this gain [nats] within which the noise of its own may still put
    another first.
    """
    return CLOSE + CLOSE_SHARE * max(gain, 0.0)


def once(finals: list[Fit]) -> list[Fit]:
    """Each hypothesis once: where two searches ended apart, from the end with less raw mismatch."""
    best: dict[tuple[object, ...], tuple[float, Fit]] = {}
    for fit in finals:
        raw = float(costs(white_noise(fit).residual(fit.u[None]))[0])
        known = best.get(_identity(fit))
        if known is None or raw < known[0]:
            best[_identity(fit)] = (raw, fit)
    return [fit for _, fit in best.values()]


def _identity(fit: Fit) -> tuple[object, ...]:
    return (*fit.problem.hypothesis.key, fit.problem.hypothesis.law)


def _contenders(start: Fit, shorts: list[Fit]) -> list[Fit]:
    """The short fits that may still win: two at least, else a fair share of the best one's gain."""
    if not shorts:
        return []
    least = CONTENDS * (start.cost - rank(shorts[0]))
    return [f for n, f in enumerate(shorts) if n < 2 or start.cost - rank(f) >= max(least, 0.0)]
