"""Name: every hypothesis is fitted as hard as the retuned machine, and they compete.

A screen orders the candidates, a short fit of each thins them out, the best are fitted to the end
with the noise that their own residuals show.  Then a second effect may join, if it pays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from corexy_fmi.engine.candidates import finer, hypotheses
from corexy_fmi.engine.fit import Fit, costs, minimise, settle, white_noise
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.pulses import pulse_fits
from corexy_fmi.engine.screen import Lead, screen
from corexy_fmi.engine.unknowns import SMOOTHING, STIFFNESS, Hypothesis

THRESHOLD = 10.0  # [nats] beyond the penalty, below which nothing is named (ENGINE 3.2)
TEMPERATURE = 3.0  # tempers the log evidence; form errors make it over-confident
AHEAD, AHEAD_BLEACHED, SHORT, FINALISTS, LAWS = 16, 6, 3, 6, 4
CLOSE, CLOSE_SHARE = 40.0, 0.25  # [nats]; share of the best one's gain: behind both all is lost
CONTENDS = 0.3  # share of the best short fit's gain that a finalist has
ALWAYS, LEAD_SHARE = 4, 0.02  # leads that are always fitted; share of the best lead's gain
LEAST = 1.5  # [nats] that any other lead gains in the screen
SECOND_SHARE = 0.04  # a second effect gains at least this share of the first one's gain
FORM = 0.3  # share of what smooth friction gains that its wrong shape may leave to others
STIFFER = 1.2  # log of the factor
LAGS = ("speed", "acceleration", "load", "velocity_reversal", "voltage")  # what soft belts pass for
LEADERS, SHAKE, AGAIN = 3, 1.0, 8  # entries fitted again, from how far beside, iterations
FAMILY = 1.15  # a free-form law must beat the catalogue's best by this factor

Mapper = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]


@dataclass(frozen=True, eq=False)
class Entry:
    """A fitted hypothesis and what it gains [nats] over the retuned machine, penalty paid."""

    hypothesis: Hypothesis
    fit: Fit
    gain: float


@dataclass(frozen=True, eq=False)
class Competition:
    """The retuned machine, all entries best first, and their probabilities."""

    retuned: Fit
    entries: tuple[Entry, ...]
    probability: tuple[float, ...]
    nothing: float

    @property
    def best(self) -> Entry | None:
        """The winner, or None where nothing pays."""
        first = self.entries[0] if self.entries else None
        return first if first and first.gain > THRESHOLD + form_floor(first.fit) else None

    def share(self, member: tuple[str, str]) -> float:
        """Probability that an (effect, location) is among what is missing."""
        pairs = zip(self.entries, self.probability, strict=True)
        return float(sum(p for e, p in pairs if member in e.hypothesis.key))


def penalty(problem: Problem, samples: int) -> float:
    """Half of the log of the sample count for each parameter beyond the nominal (BIC) [nats]."""
    count = len(problem.unknowns) - problem.nominal_count
    return 0.5 * count * float(np.log(max(samples, 2)))


def form_floor(fit: Fit) -> float:
    """Nats that the wrong shape of smooth friction may fake.

    Nobody knows how sgn is rounded, in a simulator or a machine; the nuisance has one shape.  Where
    it is at work, what it gains (half the square of its standard score) bounds what it leaves.
    """
    keys = [x.key for x in fit.problem.unknowns]
    if SMOOTHING not in keys or not np.isfinite(fit.cost):
        return 0.0
    k = keys.index(SMOOTHING)
    normal = fit.jacobian.T @ fit.jacobian
    scale = 1 / np.sqrt(np.diag(normal) + 1e-300)
    spread = np.linalg.pinv(normal * scale[:, None] * scale)[k, k] * scale[k] ** 2
    size = fit.problem.unknowns[k].value(fit.u[k]) / fit.problem.unknowns[k].scale
    return float(FORM * 0.5 * size**2 / max(spread, 1e-300))


def _samples(fit: Fit) -> int:
    return sum(run.count for run in fit.problem.runs)


def _entry(base: Fit, fit: Fit) -> Entry:
    gain = base.cost - fit.cost - penalty(fit.problem, _samples(fit))
    return Entry(fit.problem.hypothesis, fit, gain)


def _glance(lead: Lead) -> Fit:
    """One step from the lead's best start: enough to see who may win.

    It takes the nominal columns of the base's Jacobian for granted.
    """
    return minimise(lead.problem, lead.starts[0], 1, 0.5, lead.borrowed())


def _short(seen: tuple[Lead, Fit]) -> Fit:
    """A short fit from the start that goes furthest in one iteration."""
    lead, first = seen
    near = lead.borrowed()
    begun = [first, *(minimise(lead.problem, u, 1, 0.5, near) for u in lead.starts[1:])]
    best = min(begun, key=lambda f: f.cost)
    return minimise(lead.problem, best.u, 1, 0.5, near, SHORT)


def _shorts(leads: list[Lead], mapper: Mapper, count: int) -> list[Fit]:
    """Short fits of the ``count`` leads that are ahead after a glance, best first; then the others
    as seen.
    """
    seen = list(zip(leads, mapper(_glance, leads), strict=True))
    # one step may mislead where much moves at once: the screen's first go on in any case
    order = sorted(range(len(seen)), key=lambda n: (n >= ALWAYS, _rank(seen[n][1])))
    ahead = [seen[n] for n in order[:count]]
    return sorted(mapper(_short, ahead), key=_rank) + [seen[n][1] for n in order[count:]]


def _long(fit: Fit) -> Fit:
    """A fit carried to its end, under the noise that it began with."""
    return minimise(fit.problem, fit.u, 8)


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


def _round(
    base: Fit, candidates: list[Hypothesis], mapper: Mapper, finalists: int, floor: float = 0.0
) -> list[Fit]:
    """One round of competition on top of a fit; settled finalists, best first.

    Searched under the base's own noise and, where that is coloured, under white noise too: a slow
    mismatch can pass for colour, and is then invisible to a search that trusts the colour.  The
    first round also begins from stiffer belts: soft ones pass for whatever lags.
    """
    finals: list[Fit] = []
    rest: list[Fit] = []
    for start, tried, ahead in _starts(base, candidates, floor == 0):
        leads = _thin(screen(start, tried, mapper), floor)
        shorts = _shorts(leads, mapper, ahead)
        going = _contenders(start, shorts[:finalists])
        ended = sorted(mapper(_long, going), key=_rank)
        close = [f for f in ended if _rank(f) - _rank(ended[0]) < _margin(start, ended[0])]
        finals += close
        rest += ended[len(close) :] + shorts[len(going) :] if start is base else []
    settled = sorted(mapper(settle, _once(finals)), key=_rank)
    return settled + rest


def _starts(
    base: Fit, candidates: list[Hypothesis], first: bool
) -> list[tuple[Fit, list[Hypothesis], int]]:
    """Where a round searches from, for which candidates, with how many short fits."""
    bleached = [(fit, candidates, AHEAD_BLEACHED) for fit in _bleached(base)]
    lagging = [h for h in candidates if any(i.effect.state in LAGS for i in h.uses)]
    stiffer = [(fit, lagging, AHEAD_BLEACHED) for fit in _stiffer(base)] if first else []
    return [(base, candidates, AHEAD), *bleached, *stiffer]


def _margin(start: Fit, best: Fit) -> float:
    """Nats behind the best fit within which the noise of its own may still put another first."""
    return CLOSE + CLOSE_SHARE * max(start.cost - _rank(best), 0.0)


def _once(finals: list[Fit]) -> list[Fit]:
    """Each hypothesis once: where two searches ended apart, from the end with less raw mismatch."""
    best: dict[tuple[object, ...], tuple[float, Fit]] = {}
    for fit in finals:
        raw = float(np.sum(white_noise(fit).residual(fit.u[None]) ** 2))
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
    least = CONTENDS * (start.cost - _rank(shorts[0]))
    return [f for n, f in enumerate(shorts) if n < 2 or start.cost - _rank(f) >= max(least, 0.0)]


def _bleached(base: Fit) -> list[Fit]:
    """The base fitted again under white noise; nothing where its own noise is white already."""
    if not any(len(n.coefficients) for models in base.problem.noise for n in models):
        return []
    return [minimise(white_noise(base), base.u, 8)]


def _stiffer(base: Fit) -> list[Fit]:
    """The base with its belts stiffened, which a search from there holds; nothing where the
    machine file says how stiff they are, or where they are too stiff for the micro-step.
    """
    keys = base.problem.keys
    if STIFFNESS not in keys:
        return []
    k, u = keys.index(STIFFNESS), base.u.copy()
    u[k] = min(u[k] + STIFFER, base.problem.limits()[1][k])
    residual, slopes = base.problem.linearised(u)
    slopes[:, k] = 0.0
    cost = float(costs(residual[None])[0]) + base.problem.log_scale()
    return [Fit(base.problem, u, cost, residual, slopes)] if np.isfinite(cost) else []


def _rank(fit: Fit) -> float:
    return fit.cost + penalty(fit.problem, _samples(fit))


def repolish(base: Fit, winner: Fit) -> Fit:
    """The retuned machine refitted from a winner's nominal parameters; the better of both."""
    start = base.problem.carried(winner.problem, winner.u)
    other = settle(minimise(base.problem, start))
    return other if other.cost < base.cost else base


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
    if not named or base.cost - named[0].cost < THRESHOLD:
        return []
    found = _round(named[0], _extended(named[0], singles), mapper, 3, THRESHOLD)[:3]
    if not found:
        return []
    single = _polished(named[0], found[0])
    fits[fits.index(named[0])] = named[0] = single
    added = found[0].problem.hypothesis.uses[-1]
    alone = next((f for f in fits if f.problem.hypothesis.uses == (added,)), None)
    if alone is not None and _pays(named[0], found[0], base):
        found += _round(alone, _extended(alone, singles), mapper, 2, THRESHOLD)[:2]
    return [f for f in found if _pays(named[0], f, base)]


def _refined(fit: Fit) -> Fit:
    """A free-form law with twice the knots, where they pay; any other fit as it is."""
    law, own = fit.problem.hypothesis.law, fit.problem.unknowns
    if law is None:
        return fit
    first = sum(not x.key.startswith("free_form") for x in own)
    last = first + len(law.knots)
    problem = replace(fit.problem, hypothesis=Hypothesis(law=finer(law)))
    values = np.interp(finer(law).knots, law.knots, fit.u[first:last])
    start = np.concatenate([fit.u[:first], values, fit.u[last:]])
    again = settle(minimise(problem, start, 8))
    return again if _rank(again) < _rank(fit) else fit


def _polished(one: Fit, two: Fit) -> Fit:
    """The better of a fit and itself begun again where the fit with a second effect ended."""
    again = settle(minimise(one.problem, one.problem.carried(two.problem, two.u)))
    return again if again.cost < one.cost else one


def _shaken(fit: Fit, mapper: Mapper) -> Fit:
    """A fit begun again from beside where it ended: dry friction leaves many minima close by.

    Each of the effects' parameters but their sizes is pushed by its scale, up and down.
    """
    shapes = {
        f"{i.effect.name}.{i.location}.{p.name}"
        for i in fit.problem.hypothesis.uses
        for p in i.effect.parameters
        if not p.size
    }
    moved = [k for k, key in enumerate(fit.problem.keys) if key in shapes]
    starts = [fit.u + SHAKE * sign * np.eye(len(fit.u))[k] for k in moved for sign in (-1, 1)]
    again = list(mapper(lambda u: minimise(fit.problem, u, AGAIN), starts))
    best = min([fit, *again], key=lambda f: f.cost)
    return settle(best) if best.cost < fit.cost - 1 else fit


def _leaders(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries with those in the lead fitted again from beside their ends, best first."""
    ahead = [e for e in entries if e.hypothesis.uses and e.gain > entries[0].gain - CLOSE]
    again = {id(e): _entry(base, _shaken(e.fit, mapper)) for e in ahead[:LEADERS] if e.gain > 0}
    return sorted((again.get(id(e), e) for e in entries), key=lambda e: -e.gain)


def _pays(one: Fit, two: Fit, base: Fit) -> bool:
    """Whether a second effect gains enough over one."""
    gain = _rank(one) - _rank(two)
    return gain > max(THRESHOLD + form_floor(two), SECOND_SHARE * (base.cost - one.cost))


def _probabilities(gains: list[float]) -> tuple[list[float], float]:
    """Tempered probabilities of the entries and of nothing."""
    all_gains = np.array([*gains, 0.0]) / TEMPERATURE
    weights = np.exp(all_gains - all_gains.max())
    weights /= weights.sum()
    return [float(w) for w in weights[:-1]], float(weights[-1])


def _prefer_catalogue(entries: list[Entry]) -> list[Entry]:
    """A free-form law that gains little more than the best catalogued set steps behind it."""
    named = next((e for e in entries if e.hypothesis.uses and e.gain > THRESHOLD), None)
    if named is None:
        return entries
    laws = [e for e in entries if e.hypothesis.law and e.gain < FAMILY * named.gain + THRESHOLD]
    return [e for e in entries if e not in laws] + laws


def compete(
    base: Fit,
    mapper: Mapper,
    tell: Callable[[str], None] = lambda text: None,
    without: frozenset[str] = frozenset(),
) -> Competition:
    """Let every hypothesis compete on top of the retuned machine (already settled)."""
    singles = hypotheses(base.problem, base.u, without)
    tell("fitting every effect at every place")
    fits = _round(base, singles, mapper, FINALISTS)
    fits = sorted([*fits, *pulse_fits(base, singles, mapper)], key=_rank)
    base = repolish(base, fits[0]) if fits else base
    fits[:1] = [_refined(f) for f in fits[:1]]
    tell("looking for a second effect")
    pairs = _pairs(base, fits, singles, mapper)
    unique: dict[tuple[tuple[str, str], ...], Entry] = {}
    for fit in [*pairs, *fits]:
        entry = _entry(base, fit)
        held = unique.get(entry.hypothesis.key)
        if held is None or entry.gain > held.gain:
            unique[entry.hypothesis.key] = entry
    entries = sorted(unique.values(), key=lambda e: -e.gain)
    entries = _prefer_catalogue(_leaders(base, entries, mapper))
    live = [e for e in entries if not e.hypothesis.law or e is entries[0]]
    chances, nothing = _probabilities([e.gain for e in live])
    lookup = dict(zip(map(id, live), chances, strict=True))
    return Competition(
        base, tuple(entries), tuple(lookup.get(id(e), 0.0) for e in entries), nothing
    )
