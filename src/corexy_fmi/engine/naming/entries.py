"""The entries of a competition: fitted hypotheses, what they gain, how probable they are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.unknowns import SMOOTHING, Hypothesis
from corexy_fmi.engine.naming.idle import idle, lighter
from corexy_fmi.engine.naming.search import CLOSE, penalty, samples_of

THRESHOLD = 10.0  # [nats] beyond the penalty, below which nothing is named (ENGINE 3.2)
TEMPERATURE = 3.0  # tempers the log evidence; form errors make it over-confident
CEILING = 0.97  # of a probability: of 544 cases `explained` in development, 526 were right
FORM = 0.3  # share of what smooth friction gains that its wrong shape may leave to others
FAMILY = 1.15  # a free-form law must beat the catalogue's best single cause by this factor


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
        """Probability that an (effect, location) is among what is missing, as it is told."""
        pairs = zip(self.entries, self.probability, strict=True)
        total = float(sum(p for e, p in pairs if member in e.hypothesis.key))
        return told(total)


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


def entry_of(base: Fit, fit: Fit) -> Entry:
    """A fit with what it gains [nats] over the retuned machine ``base``."""
    gain = base.cost - fit.cost - penalty(fit.problem, samples_of(fit))
    return Entry(fit.problem.hypothesis, fit, gain)


def joined(base: Fit, entries: list[Entry], fits: Iterable[Fit]) -> list[Entry]:
    """The entries, best first, with each fit in the place of what gains less by the same effects,
    or beside them; laws among the entries stay.
    """
    known = {e.hypothesis.key: e for e in entries if not e.hypothesis.law}
    for entry in (entry_of(base, fit) for fit in fits):
        held = known.get(entry.hypothesis.key)
        if held is None or entry.gain > held.gain:
            known[entry.hypothesis.key] = entry
    laws = [e for e in entries if e.hypothesis.law]
    return sorted([*known.values(), *laws], key=lambda e: -e.gain)


def probabilities(gains: list[float]) -> tuple[list[float], float]:
    """Tempered probabilities of the entries and of nothing."""
    all_gains = np.array([*gains, 0.0]) / TEMPERATURE
    weights = np.exp(all_gains - all_gains.max())
    weights /= weights.sum()
    return [float(w) for w in weights[:-1]], float(weights[-1])


def told(chance: float) -> float:
    """A probability as it is told: the catalogue may lack the cause, a set a second one."""
    return min(chance, CEILING)


def ranked(base: Fit, entries: list[Entry], equal: Entry | None = None) -> Competition:
    """A competition of entries, best first; of free-form laws only one that leads, or is the
    leader's ``equal``, has a share.
    """
    live = [e for e in entries if not e.hypothesis.law or e is entries[0] or e is equal]
    chances, nothing = probabilities([e.gain for e in live])
    lookup = dict(zip(map(id, live), chances, strict=True))
    shares = tuple(lookup.get(id(e), 0.0) for e in entries)
    return Competition(base, tuple(entries), shares, nothing)


def catalogue_first(entries: list[Entry]) -> list[Entry]:
    """A free-form law that gains little more than the best catalogued cause steps behind it.

    Of a set of several, the second may do no more than mend the form of the first: such a set has
    no share on top.
    """
    named = next((e for e in entries if e.hypothesis.uses and e.gain > THRESHOLD), None)
    if named is None:
        return entries
    share = FAMILY if len(named.hypothesis.uses) == 1 else 1.0
    laws = [e for e in entries if e.hypothesis.law and e.gain < share * named.gain + THRESHOLD]
    return [e for e in entries if e not in laws] + laws


def shed(base: Fit, entries: list[Entry], mapper: Mapper) -> list[Entry]:
    """The entries, best first, with those sets near the first that are as good without one of
    their effects fitted without it: it has led the others out of where they were stuck.
    """
    least = max(entries[0].gain - CLOSE, 0.0) if entries else 0.0
    near = [e.fit for e in entries if len(e.hypothesis.uses) > 1 and e.gain > least]
    found = list(mapper(lambda fit: lighter(fit, THRESHOLD), near))
    spare = {id(fit) for fit, light in zip(near, found, strict=True) if light is not fit}
    kept = [e for e in entries if id(e.fit) not in spare]
    return joined(base, kept, [light for light in found if id(light) not in spare])


def without_idle(entries: list[Entry]) -> list[Entry]:
    """The entries without those near the first that gain what they gain without their size."""
    least = max(entries[0].gain - CLOSE, 0.0) if entries else 0.0
    near = [e for e in entries if e.hypothesis.uses and e.gain > least]
    spare = [e for e in near if idle(e.fit, THRESHOLD)] if len(near) > 1 else []
    return [e for e in entries if e not in spare] if len(spare) < len(near) else entries
