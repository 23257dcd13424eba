"""Site: at which place small unknown laws explain a mismatch best, whatever the catalogue holds.

The probes of each place (`probes.py`) compete as a whole: the best few of them, chosen one by one,
each charged for what it costs to choose it (BIC, and the logarithm of how many there are).  Linear,
around the retuned machine, under the noise that the best explanation leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.choice import Choice, choose
from corexy_fmi.engine.entries import TEMPERATURE, THRESHOLD, Competition
from corexy_fmi.engine.fit import Fit, Mapper, minimise
from corexy_fmi.engine.probes import motions
from corexy_fmi.engine.responses import Response, responses
from corexy_fmi.engine.retune import quick
from corexy_fmi.kernel.call import Array
from corexy_fmi.topologies import COREXY

MOST = 150_000  # samples from which on the responses take too much memory
PAIRS = {"motors": ("motor1", "motor2"), "belts": ("belt1", "belt2"), "xy": ("x", "y")}
PARTS = {"motors": PAIRS["motors"], "xy": PAIRS["xy"]}  # places of their own
AMISS, PART = 20.0, 0.02  # [nats] beside what is not the whole; share of what that gains
AGAIN = 6  # iterations of the retuned machine under another noise


@dataclass(frozen=True)
class Site:
    """A place (CONTRACT 5), what its probes gain [nats] over the retuned machine, the state and
    word of the best of them, and the place's probability among all.
    """

    location: str
    gain: float
    state: str = ""
    word: str = ""
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
    return _paying(fit, base.cost - fit.cost, mapper)


def beside(competition: Competition, mapper: Mapper) -> list[Site]:
    """Places by what their probes gain on top of the catalogued winner, under its own noise: where
    that is much, the winner is not the whole of it.
    """
    best = competition.best
    if best is None or best.hypothesis.law or not _moves(best.fit):
        return []
    return _paying(best.fit, 0.0, mapper)


def _moves(fit: Fit) -> bool:
    """Whether the places of a fit's stage can be asked: a Core-XY that moves, on data few enough to
    keep all responses.
    """
    machine, count = fit.problem.machine, sum(run.count for run in fit.problem.runs)
    asked = machine.kind.name == COREXY and machine.fidelity != "kinematic" and count <= MOST
    return asked and bool(np.isfinite(fit.cost))


def _paying(fit: Fit, lost: float, mapper: Mapper) -> list[Site]:
    """Places that pay, best first; ``lost`` as in `_site`."""
    found = _asked(quick(fit), mapper)
    return _probable([_site(n, c, lost) for n, c in found.items() if c.taken])


def _asked(fit: Fit, mapper: Mapper) -> dict[str, Choice]:
    """What every place's probes explain."""
    runs, (q, _) = motions(fit), np.linalg.qr(fit.jacobian)
    price = 0.5 * float(np.log(max(sum(run.count for run in fit.problem.runs), 2)))
    found: dict[str, Choice] = {}
    for kind in responses(fit, runs, q, mapper):
        found |= of_places(kind, fit.residual, price)
    return found


def of_places(found: list[Response], residual: Array, price: float) -> dict[str, Choice]:
    """Every place by itself; both of a kind together where the second pays for itself."""
    by_place: dict[str, list[Response]] = {}
    for response in found:
        by_place.setdefault(response.location, []).append(response)
    result = {name: choose(own, residual, price) for name, own in by_place.items()}
    for both, (one, other) in PAIRS.items():
        if one in by_place:
            own, more = by_place[one], by_place[other]
            union = choose([*own, *more, *_tied(both, own, more)], residual, price)
            alone = max(result[one].gain, result[other].gain)
            if union.gain > (1 + PART) * alone + THRESHOLD or both not in PARTS:
                result[both] = union
    return {n: c for n, c in result.items() if not n.startswith("belt") or n == "belts"}


def _tied(both: str, one: list[Response], other: list[Response]) -> list[Response]:
    """The same law at both places; of belts its mirror, too."""
    signs = (1.0, -1.0) if both == "belts" else (1.0,)
    return [
        Response(both, a.state, a.word, a.change + np.float32(sign) * b.change, a.chosen)
        for a, b in zip(one, other, strict=True)
        for sign in signs
    ]


def _site(name: str, choice: Choice, lost: float) -> Site:
    """A place; ``lost`` is what the retuned machine gained [nats] by its own noise."""
    first = choice.taken[0]
    return Site(name, choice.gain + lost, first.state, first.word)


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
