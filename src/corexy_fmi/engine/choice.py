"""The best few of many linear responses, chosen one by one while each pays for its choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.quiet import own_models
from corexy_fmi.engine.responses import Response
from corexy_fmi.engine.view import View
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


@dataclass(frozen=True, eq=False)
class Offer:
    """Responses of a place, and what they are through a view: `View.off`."""

    responses: tuple[Response, ...]
    off: Array
    along: Array

    @staticmethod
    def of(responses: Sequence[Response], view: View) -> Offer:
        """The responses through a view."""
        return Offer(tuple(responses), *view.off(np.array([r.change for r in responses])))

    def beside(self, other: Offer, place: str, signs: Sequence[float]) -> Offer:
        """Those of two places, and each law at both of them at once, alike or with other signs."""
        pairs = list(zip(self.responses, other.responses, strict=True))
        tied = [
            replace(a, location=place, change=a.change + np.float32(sign) * b.change)
            for sign in signs
            for a, b in pairs
        ]
        both = (
            np.concatenate([one, two, *(one + one.dtype.type(sign) * two for sign in signs)])
            for one, two in ((self.off, other.off), (self.along, other.along))
        )
        return Offer((*self.responses, *other.responses, *tied), *both)


def choose(changes: Array, residual: Array, prices: Array) -> tuple[list[int], float]:
    """Which changes (k, n) explain a residual (n,), greedily, and what they gain [nats]; each costs
    its price (k,) [nats].
    """
    size = np.sqrt(np.maximum(np.einsum("ij,ij->i", changes, changes), 1e-30)).astype(float)
    pull = (changes @ residual.astype(np.float32)) / size
    left, taken, steps, gain = np.where(size > 1e-12, 1.0, 0.0), [], np.zeros((0, len(size))), 0.0
    for _ in range(TERMS):
        score = np.where(left > NEW, 0.5 * pull**2 / np.maximum(left, NEW), 0.0)
        best = int(np.argmax(score - prices))
        if score[best] < prices[best]:
            break
        taken.append(best)
        gain += float(score[best] - prices[best])
        alike = (changes @ changes[best]) / (size * size[best]) - steps[:, best] @ steps
        along = alike / np.sqrt(left[best])
        steps = np.vstack([steps, along])
        pull = pull - along * (pull[best] / np.sqrt(left[best]))
        left = left - along**2
    return taken, gain


def explain(offer: Offer, view: View, price: float, nothing: float, rounds: int) -> Choice:
    """The best choice of responses through a view, or, in some more ``rounds``, through the noise
    that such a choice leaves; what it gains is over the cost of ``nothing`` [nats].

    Each response costs ``price`` [nats] and the logarithm of how many are offered, and what its own
    choice by the data does.
    """
    own = np.array([r.chosen for r in offer.responses])
    prices, best = price + np.log(len(offer.responses)) + own, Choice()
    for more in reversed(range(1 + rounds)):
        taken, gain = choose(offer.off, view.residual, prices)
        gain += nothing - view.cost
        if taken and (gain > best.gain or not best.taken):
            best = Choice(tuple(offer.responses[k] for k in taken), gain)
        if not taken or not more:
            break
        changes = np.array([offer.responses[k].change for k in taken])
        left = view.left((changes, offer.off[taken], offer.along[taken]))
        kept = np.union1d(_strongest(offer.off, view.residual), taken)
        prices, view = prices[kept], View(view.fit, own_models(view.problem.runs, left))
        offer = Offer.of([offer.responses[k] for k in kept], view)
    return best


def _strongest(changes: Array, residual: Array) -> np.ndarray:
    """Indices of the changes (k, n) that by themselves explain most of a residual (n,)."""
    size = np.maximum(np.einsum("ij,ij->i", changes, changes), 1e-30)
    return np.argsort(-((changes @ residual.astype(np.float32)) ** 2) / size)[:NEAR]
