"""Site: at which place small unknown laws explain a mismatch best, whatever the catalogue holds.

The probes of each place (`probes.py`) compete as a whole: the best few of them, chosen one by one,
each charged for what it costs to choose it (BIC, and the logarithm of how many there are).  Linear,
around the retuned machine, under the noise that the best explanation leaves.  Where no place is the
whole of it so, that noise may hold the mismatch, as slow ones pass for colour: then each place is
judged by the noise that it leaves itself, from the least on that the samples allow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, white_noise
from corexy_fmi.engine.fitting.quiet import own_models
from corexy_fmi.engine.fitting.retune import quick
from corexy_fmi.engine.naming.entries import TEMPERATURE, THRESHOLD, Competition
from corexy_fmi.engine.places.choice import ROUNDS, Choice, explain
from corexy_fmi.engine.places.offer import Offer
from corexy_fmi.engine.places.probes import motions
from corexy_fmi.engine.places.responses import Response, responses
from corexy_fmi.engine.places.view import View, plain
from corexy_fmi.topologies import COREXY

MOST = 180_000  # samples from which on no place is asked, for room: 171 000 take 1.9 GiB
PAIRS = {"motors": ("motor1", "motor2"), "belts": ("belt1", "belt2"), "xy": ("x", "y")}
PARTS = {"motors": PAIRS["motors"], "xy": PAIRS["xy"]}  # places of their own
AMISS, PART = 20.0, 0.02  # [nats] beside what is not the whole; share of what that gains
BOTH = 0.2  # share of what one of two parts gains that the other one adds at least
HALF = 0.5  # share of the best cause's gain from which on a place is as good as the whole of it
AGAIN = 6  # iterations of the retuned machine under another noise


@dataclass(frozen=True)
class Site:
    """A place (CONTRACT 5), what its probes gain [nats] over the retuned machine, the state and
    word of the best of them, the states of all, and the place's probability among all places.
    """

    location: str
    gain: float
    state: str = ""
    word: str = ""
    states: tuple[str, ...] = ()
    probability: float = 0.0


def sites(competition: Competition, mapper: Mapper) -> list[Site]:
    """Places by what their probes gain, best first; none where the stage is not a Core-XY one that
    moves, or where the data are too many to keep all responses.
    """
    base = fit = competition.retuned
    if not _moves(base):
        return []
    if competition.entries:
        noise = competition.entries[0].fit.problem.noise
        fit = minimise(replace(base.problem, noise=noise), base.u, AGAIN)
    offered, given = _offered(fit, mapper)
    found = _paying(offered, [given], base.cost - fit.cost + given.cost, mapper)
    known = max([0.0, *(e.gain for e in competition.entries)])
    if found and found[0].gain > max(THRESHOLD, HALF * known):
        return found
    views = [given, View(given.fit, white_noise(fit).noise)]
    nothing = min(base.cost, *(v.cost for v in views), *(_settled(v).cost for v in views))
    again = _paying(offered, views, nothing, mapper)
    return max(again, found, key=lambda some: some[0].gain if some else 0.0)


def beside(competition: Competition, mapper: Mapper) -> list[Site]:
    """Places by what their probes gain on top of the catalogued winner, under its own noise: where
    that is much, the winner is not the whole of it.
    """
    best = competition.best
    if best is None or best.hypothesis.law or not _moves(best.fit):
        return []
    offered, view = _offered(best.fit, mapper)
    return _paying(offered, [view], view.cost, mapper)


def _offered(fit: Fit, mapper: Mapper) -> tuple[list[list[Response]], View]:
    """What every place's probes do to a fit, and that fit through its own noise."""
    bare = plain(quick(fit))
    return [*responses(bare, motions(bare), mapper)], View(bare, fit.problem.noise)


def _moves(fit: Fit) -> bool:
    """Whether the places of a fit's stage can be asked: a Core-XY that moves, on data few enough to
    keep all responses.
    """
    machine, count = fit.problem.machine, sum(run.count for run in fit.problem.runs)
    asked = machine.kind.name == COREXY and machine.fidelity != "kinematic" and count <= MOST
    return asked and bool(np.isfinite(fit.cost))


def _paying(
    offered: Sequence[list[Response]], views: Sequence[View], nothing: float, mapper: Mapper
) -> list[Site]:
    """Places that pay, best first, through these views; gains are over the cost of ``nothing``."""
    price = 0.5 * float(np.log(max(sum(run.count for run in views[0].fit.problem.runs), 2)))
    rounds = ROUNDS if len(views) > 1 else 0
    found: dict[str, Choice] = {}
    for kind, view in product(offered, views):
        explained = partial(explain, view=view, price=price, nothing=nothing, rounds=rounds)
        for name, choice in of_places(kind, view, explained, mapper).items():
            found[name] = max(choice, found.get(name, choice), key=lambda c: c.gain)
    return _probable([_site(n, c) for n, c in shared(found).items() if c.gain > 0])


def _settled(view: View) -> View:
    """The same through the noise that retuning alone leaves there."""
    return View(view.fit, own_models(view.problem.runs, view.left()))


def of_places(
    found: Sequence[Response], view: View, explained: Callable[[Offer], Choice], mapper: Mapper
) -> dict[str, Choice]:
    """What explains every place of a kind through a view, and two of a kind together."""
    rows: dict[str, list[Response]] = {}
    for response in found:
        rows.setdefault(response.location, []).append(response)
    offers = dict(zip(rows, mapper(lambda own: Offer.of(own, view), rows.values()), strict=True))
    for both, (one, other) in PAIRS.items():
        if one in offers:
            signs = (1.0, -1.0) if both == "belts" else (1.0,)
            offers[both] = offers[one].beside(offers[other], both, signs)
    asked = [n for n in offers if not n.startswith("belt") or n == "belts"]
    return dict(zip(asked, mapper(explained, [offers[n] for n in asked]), strict=True))


def shared(found: dict[str, Choice]) -> dict[str, Choice]:
    """Places without those of two parts where the second does not pay for itself."""
    alone = {
        both: max(found[one].gain, found[other].gain)
        for both, (one, other) in PARTS.items()
        if both in found
    }
    lost = {n for n, gain in alone.items() if found[n].gain <= (1 + BOTH) * gain + THRESHOLD}
    return {n: choice for n, choice in found.items() if n not in lost}


def _site(name: str, choice: Choice) -> Site:
    first = choice.taken[0]
    states = tuple(probe.state for probe in choice.taken)
    return Site(name, choice.gain, first.state, first.word, states)


def _probable(found: list[Site]) -> list[Site]:
    """Sites best first, each with its share by tempered gains."""
    ranked = sorted(found, key=lambda site: -site.gain)
    weights = np.exp([(s.gain - ranked[0].gain) / TEMPERATURE for s in ranked])
    shares = weights / max(float(weights.sum()), 1e-300)
    return [replace(s, probability=float(p)) for s, p in zip(ranked, shares, strict=True)]


def elsewhere(found: Sequence[Site], places: Sequence[str], gain: float) -> Site | None:
    """The best site, if it explains more, by the threshold, than causes at these places do, which
    gain so much, and is none of them.
    """
    first = next(iter(found), None)
    if first is None or first.gain <= gain + THRESHOLD or _touches(first.location, places):
        return None
    return first


def remaining(found: Sequence[Site], gain: float) -> Site | None:
    """The best of the sites beside a cause that gains so much, if that is not the whole of it."""
    first = next(iter(found), None)
    return first if first is not None and first.gain > max(AMISS, PART * gain) else None


def _touches(location: str, places: Sequence[str]) -> bool:
    """Whether a place is one of others, or shares a part with one; pulleys are parts of belts and
    turn with motors.
    """
    own, known = parts(location), {part for place in places for part in parts(place)}
    turning = {"belts", *PARTS["motors"]}
    idlers = any(part.startswith("pulley") for part in own | known)
    return bool(own & known) or (idlers and bool(turning & (own | known)))


def parts(place: str) -> set[str]:
    """A place, and those that it is made of."""
    return {place, *PARTS.get(place, ())}
