"""Name: every hypothesis is fitted as hard as the retuned machine, and they compete.

A search (`search.py`) gives the best single causes.  Then a second effect may join, if it pays, and
the leaders are fitted again from beside their ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.candidates import finer, hypotheses
from corexy_fmi.engine.fit import Fit, Mapper, fine, minimise, settle
from corexy_fmi.engine.idle import idle
from corexy_fmi.engine.overtones import overtone_fits
from corexy_fmi.engine.pulses import pulse_fits
from corexy_fmi.engine.restart import LEADER, begun, best
from corexy_fmi.engine.rough import softened, unstuck
from corexy_fmi.engine.search import (
    CLOSE,
    FINALISTS,
    penalty,
    rank,
    samples_of,
    search,
)
from corexy_fmi.engine.unknowns import SMOOTHING, Hypothesis

THRESHOLD = 10.0  # [nats] beyond the penalty, below which nothing is named (ENGINE 3.2)
TEMPERATURE = 3.0  # tempers the log evidence; form errors make it over-confident
SECOND_SHARE = 0.04  # a second effect gains at least this share of the first one's gain
FORM = 0.3  # share of what smooth friction gains that its wrong shape may leave to others
LEADERS, SHAKE, AGAIN = 3, 1.0, 8  # entries fitted again, from how far beside, iterations
ELSEWHERE = 0.5  # share of the first one's gain that its effect has at another place, to go on
BETTER = 1.0  # [nats] that it must gain to be taken
FAMILY = 1.15  # a free-form law must beat the catalogue's best by this factor


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
        total = float(sum(p for e, p in pairs if member in e.hypothesis.key))
        return min(total, 1.0)  # a sum of shares may round to more


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


def _entry(base: Fit, fit: Fit) -> Entry:
    gain = base.cost - fit.cost - penalty(fit.problem, samples_of(fit))
    return Entry(fit.problem.hypothesis, fit, gain)


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
    if not named or base.cost - rank(named[0]) < THRESHOLD:
        return []
    found = search(named[0], _extended(named[0], singles), mapper, 3, THRESHOLD)[:3]
    if not found:
        return []
    single = _polished(named[0], found[0])
    fits[fits.index(named[0])] = named[0] = single
    added = found[0].problem.hypothesis.uses[-1]
    alone = next((f for f in fits if f.problem.hypothesis.uses == (added,)), None)
    if alone is not None and _pays(named[0], found[0], base):
        tried = {f.problem.hypothesis.key for f in fits}  # what the first round thought worth a fit
        others = [s for s in singles if s.key in tried]
        found += search(alone, _extended(alone, others), mapper, 2, THRESHOLD)[:2]
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
    return again if rank(again) < rank(fit) else fit


def _polished(one: Fit, two: Fit) -> Fit:
    """The better of a fit and itself begun again where the fit with a second effect ended."""
    again = settle(minimise(one.problem, one.problem.carried(two.problem, two.u)))
    return again if again.cost < one.cost else one


def _shaken(fit: Fit, mapper: Mapper) -> Fit:
    """A fit begun again from beside where it ended: dry friction leaves many minima close by.

    Each of the effects' parameters but their sizes is pushed by its scale, up and down; the best
    end is carried on over rough ground.
    """
    shapes = {
        f"{i.effect.name}.{i.location}.{p.name}"
        for i in fit.problem.hypothesis.uses
        for p in i.effect.parameters
        if not p.size
    }
    moved = [k for k, key in enumerate(fit.problem.keys) if key in shapes]
    starts = [fit.u + SHAKE * sign * np.eye(len(fit.u))[k] for k in moved for sign in (-1, 1)]
    starts += [best(begun(fit.problem, fit.u, LEADER, mapper)).u]
    again = list(mapper(lambda u: minimise(fit.problem, u, AGAIN), starts))
    found = unstuck(best([fit, *again]))
    return settle(found) if found.cost < fit.cost - BETTER else fit


def _leaders(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries with those in the lead fitted again from beside their ends, best first."""
    named = [e for e in entries if e.hypothesis.uses]
    ahead = [e for e in named if _leads(e, named[0])]
    again = {id(e): _entry(base, _shaken(e.fit, mapper)) for e in ahead[:LEADERS] if e.gain > 0}
    return sorted((again.get(id(e), e) for e in entries), key=lambda e: -e.gain)


def _matched(base: Fit, entries: list[Entry]) -> tuple[Fit, list[Entry]]:
    """The retuned machine begun again where the winner ended, and what all gain over that."""
    if not entries:
        return base, entries
    again = fine(repolish(base, entries[0].fit))
    lost = base.cost - again.cost
    fined = _entry(base, fine(entries[0].fit))
    first = replace(fined, fit=softened(fined.fit))
    return softened(again), [replace(e, gain=e.gain - lost) for e in (first, *entries[1:])]


def _leads(entry: Entry, first: Entry) -> bool:
    """Whether an entry is close to the first, or is its effect at another place."""
    same = [n for n, _ in entry.hypothesis.key] == [n for n, _ in first.hypothesis.key]
    return entry.gain > first.gain - CLOSE or (same and entry.gain > ELSEWHERE * first.gain)


def _pays(one: Fit, two: Fit, base: Fit) -> bool:
    """Whether a second effect gains enough over one."""
    gain = rank(one) - rank(two)
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


def _without_idle(entries: list[Entry]) -> list[Entry]:
    """The entries without those near the first that gain what they gain without their size."""
    least = max(entries[0].gain - CLOSE, 0.0) if entries else 0.0
    near = [e for e in entries if e.hypothesis.uses and e.gain > least]
    spare = [e for e in near if idle(e.fit, THRESHOLD)] if len(near) > 1 else []
    return [e for e in entries if e not in spare] if len(spare) < len(near) else entries


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
    base, entries = _matched(base, _leaders(base, entries, mapper))
    entries = _prefer_catalogue(_without_idle(entries))
    live = [e for e in entries if not e.hypothesis.law or e is entries[0]]
    chances, nothing = _probabilities([e.gain for e in live])
    lookup = dict(zip(map(id, live), chances, strict=True))
    return Competition(
        base, tuple(entries), tuple(lookup.get(id(e), 0.0) for e in entries), nothing
    )
