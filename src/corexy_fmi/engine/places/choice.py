"""The best few of many linear responses, chosen one by one while each pays for its choice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.fitting.quiet import own_models
from corexy_fmi.engine.places.offer import Offer
from corexy_fmi.engine.places.responses import Response
from corexy_fmi.engine.places.view import View
from corexy_fmi.kernel.call import Array

TERMS = 8  # responses that are taken at most
NEW = 1e-3  # share of its size that a response keeps beside those taken before it
NEAR = 32  # responses, the best by themselves, that are asked again under another noise
ROUNDS = 2  # that the noise of what a choice leaves is asked instead


@dataclass(frozen=True, eq=False)
class Choice:
    """What was taken, the best first, and what it gains [nats], its price paid."""

    taken: tuple[Response, ...] = ()
    gain: float = 0.0


def choose(offer: Offer, residual: Array, prices: Array) -> tuple[list[int], float, Array]:
    """Which of the responses explain a residual (n,), greedily, and what they gain [nats]; each
    costs its price (len,) [nats].  Also what each by itself explains (len,) [nats].
    """
    powers = offer.powers()
    left, size = np.where(powers > 1e-24, 1.0, 0.0), np.sqrt(np.maximum(powers, 1e-24))
    pull = left * offer.times(residual) / size
    alone = 0.5 * pull**2
    taken, steps, gain = [], np.zeros((0, len(size))), 0.0
    for _ in range(TERMS):
        score = np.where(left > NEW, 0.5 * pull**2 / np.maximum(left, NEW), 0.0)
        best = int(np.argmax(score - prices))
        if score[best] < prices[best]:
            break
        taken.append(best)
        gain += float(score[best] - prices[best])
        alike = offer.times(offer.row(best)) / (size * size[best]) - steps[:, best] @ steps
        along = alike / np.sqrt(left[best])
        steps = np.vstack([steps, along])
        pull = pull - along * (pull[best] / np.sqrt(left[best]))
        left = left - along**2
    return taken, gain, alone


def explain(offer: Offer, view: View, price: float, nothing: float, rounds: int) -> Choice:
    """The best choice of responses through a view, or, in some more ``rounds``, through the noise
    that such a choice leaves; what it gains is over the cost of ``nothing`` [nats].

    Each response costs ``price`` [nats] and the logarithm of how many are offered, and what its own
    choice by the data does.
    """
    prices, best = price + np.log(len(offer)) + offer.chosen(), Choice()
    for more in reversed(range(1 + rounds)):
        taken, gain, alone = choose(offer, view.residual, prices)
        gain += nothing - view.cost
        some = tuple(offer.response(k) for k in taken)
        if taken and (gain > best.gain or not best.taken):
            best = Choice(some, gain)
        if not taken or not more:
            break
        off, along = ([told(k) for k in taken] for told in (offer.row, offer.reach))
        left = view.left((np.array([r.change for r in some]), np.array(off), np.array(along)))
        kept = np.union1d(np.argsort(-alone)[:NEAR], taken)
        prices, view = prices[kept], View(view.fit, own_models(view.problem.runs, left))
        offer = Offer.of([offer.response(k) for k in kept], view)
    return best
