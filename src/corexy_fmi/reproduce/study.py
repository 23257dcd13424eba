"""Where in physical ranges the claims hold, and what decides each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from corexy_fmi.reproduce.measure import MIDDLE
from corexy_fmi.reproduce.regime import regime
from corexy_fmi.reproduce.sets import RANGES, Parameters

Flags = NDArray[np.bool_]
Array = NDArray[np.float64]
OVERDAMPED = {"zeta_x": 3.0, "zeta_y": 1.2}  # above which the specification expects all to hold
DRY = 0.15  # share of Coulomb friction in the drag below which it does


@dataclass(frozen=True)
class Split:
    """One quantity cut in two: the claim holds rather ``side`` of ``at``.

    ``score`` is the mean of the shares put right among sets where it holds and where it does not
    (0.5 is chance); ``rank`` the rank correlation of quantity and claim.
    """

    quantity: str
    side: str
    at: float
    score: float
    rank: float


def quantities(sets: Sequence[Parameters]) -> dict[str, Array]:
    """What may decide: drawn parameters and the regime, each (sets,)."""
    regimes = [regime(p, MIDDLE) for p in sets]
    found = {name: np.array([p[name] for p in sets]) for name in RANGES}
    return found | {name: np.array([r[name] for r in regimes]) for name in regimes[0]}


def split(name: str, values: Array, holds: Flags) -> Split:
    """The best cut of one quantity; needs sets of both kinds."""
    order = np.argsort(values, kind="stable")
    held = np.cumsum(holds[order])[:-1] / holds.sum()  # share of those that hold, at or below
    failed = np.cumsum(~holds[order])[:-1] / (~holds).sum()
    best = int(np.argmax(np.abs(held - failed)))
    side = "below" if held[best] > failed[best] else "above"
    at = float(values[order][best : best + 2].mean())
    rank = float(np.corrcoef(rankdata(values), holds)[0, 1])
    return Split(name, side, at, float(0.5 + np.abs(held - failed)[best] / 2), rank)


def splits(known: Mapping[str, Array], holds: Flags) -> list[Split]:
    """All quantities, the most telling first; none where the claim always or never holds."""
    if holds.all() or not holds.any():
        return []
    found = [split(name, values, holds) for name, values in known.items()]
    return sorted(found, key=lambda s: -s.score)


def overdamped(known: Mapping[str, Array]) -> Flags:
    """The regime in which the specification expects all claims together."""
    above = [known[name] > limit for name, limit in OVERDAMPED.items()]
    dry = [known[f"coulomb_share_{axis}"] < DRY for axis in "xy"]
    return np.all([*above, *dry], axis=0)
