"""The best few of many linear responses, chosen one by one while each pays for its choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.responses import Response
from corexy_fmi.kernel.call import Array

TERMS = 8  # responses that are taken at most
NEW = 1e-3  # share of its size that a response keeps beside those taken before it


@dataclass(frozen=True, eq=False)
class Choice:
    """What was taken, the best first, and what it gains [nats], its price paid."""

    taken: tuple[Response, ...] = ()
    gain: float = 0.0


def choose(offered: Sequence[Response], residual: Array, price: float) -> Choice:
    """Responses (of unit size) that explain a residual, greedily; each costs ``price`` [nats] and
    the logarithm of how many are offered, and what its own choice by the data does.
    """
    changes = np.array([r.change for r in offered])
    size = np.sqrt(np.einsum("ij,ij->i", changes, changes))
    changes /= np.where(size > 0, size, 1)[:, None]
    pull = (changes @ residual.astype(np.float32)).astype(float)
    gram = (changes @ changes.T).astype(float)
    prices = price + np.log(len(offered)) + np.array([r.chosen for r in offered])
    taken, gain = [], 0.0
    for _ in range(TERMS):
        left = np.diag(gram)
        score = np.where(left > NEW, 0.5 * pull**2 / np.maximum(left, NEW), 0.0)
        best = int(np.argmax(score - prices))
        if score[best] < prices[best]:
            break
        taken.append(offered[best])
        gain += float(score[best] - prices[best])
        along = gram[best] / np.sqrt(left[best])
        pull = pull - along * (pull[best] / np.sqrt(left[best]))
        gram = gram - np.outer(along, along)
    return Choice(tuple(taken), gain)
