"""The search for the smallest nameable size of an effect, by a share of what naming it takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from corexy_fmi.kernel.layout import Instance

ROUNDS, CLOSE, NEAR = 16, 0.1, 0.3  # searches for a size; log of the share, aimed at and accepted
LEAST, STRIDE, FAREST, EDGE = 1e-3, 3.0, 12.0, 0.1  # share; on the scale of size; of a bracket
SLOWEST = 0.2  # rate that is believed: on rough ground a share may fall where a size grows
RIVALS = 3  # the nearest, of which each is fitted
Shares = Callable[[dict[str, float]], tuple[float, list[Instance]]]


@dataclass(frozen=True)
class Nameable:
    """The smallest size of one effect that one program shows, and its nearest rival there.

    ``size`` is None where no size within the effect's bounds does.  ``others`` are the effect's
    other parameters at which it holds.
    """

    name: str
    location: str
    parameter: str
    size: float | None
    neutral: float
    unit: str
    program: str
    rival: str
    others: dict[str, float]


@dataclass(frozen=True, eq=False)
class Sized:
    """An effect's smallest size on one program, its nearest rivals, nearest first, and the share
    at which the search for a size ended.
    """

    row: Nameable
    instance: Instance
    rivals: tuple[Instance, ...]
    share: float


def sized(instance: Instance, start: dict[str, float], program: str, share_of: Shares) -> Sized:
    """The size at which a share is 1, searched from a start."""
    size, search = instance.effect.size, Search()
    values, rivals = start, list[Instance]()
    for _ in range(ROUNDS):
        values = stronger(instance, start, search.place)
        share, rivals = share_of(values)
        if not search.goes_on(share):
            break
    least = search.share > 1 and values[size.name] in (size.lower, size.upper)
    near = abs(np.log(max(search.share, LEAST))) < NEAR
    found = values[size.name] if near or least else None
    others = {n: v for n, v in values.items() if n != size.name}
    rival = f"{rivals[0].effect.name} at {rivals[0].location}" if rivals else "none"
    row = Nameable(instance.effect.name, instance.location, size.name, found, size.neutral,
                   size.unit_at(instance.location), program, rival, others)  # fmt: skip
    return Sized(row, instance, tuple(rivals[:RIVALS]), search.share)


def stronger(instance: Instance, start: dict[str, float], place: float) -> dict[str, float]:
    """Values at which an effect is exp(place) times as strong, as far as it is in proportion to its
    sizes, all of which move.
    """
    found = dict(start)
    for p in instance.effect.sizes:
        factor = float(np.exp(place * (p.scaling or 1)))
        away = (start[p.name] - p.neutral) * factor
        found[p.name] = start[p.name] * factor if p.log else p.neutral + away
        found[p.name] = min(max(found[p.name], p.lower), p.upper)
    return found


@dataclass
class Search:
    """Where on a logarithmic scale of size a share is 1: secants within what is bracketed, begun at
    ``place``.  The share is in proportion to the size until it ``learns`` at what ``rate`` their
    logarithms go: softer bristles hardly change more.
    """

    place: float = 0.0
    close: float = CLOSE
    share: float = 0.0
    below: tuple[float, float] | None = None  # place and logarithm of a share below 1, and above
    above: tuple[float, float] | None = None
    learns: bool = False
    rate: float = 1.0
    last: tuple[float, float] | None = None

    @property
    def crossing(self) -> float:
        """Where the share is 1 by the last place and the rate, if near; else that place."""
        place, off = self.last or (self.place, 0.0)
        return place - off / self.rate if abs(off) < self.close * self.rate else place

    def goes_on(self, share: float) -> bool:
        """Take the share at this place and go to the next; False where it is near enough."""
        self.share, known = share, (self.place, float(np.log(max(share, LEAST))))
        if self.learns and self.last and self.last[0] != known[0]:
            slope = (known[1] - self.last[1]) / (known[0] - self.last[0])
            self.rate = min(slope, 1.0) if slope > SLOWEST else 1.0
        self.last = known
        if abs(known[1]) < self.close * self.rate:
            return False
        self.below, self.above = (known, self.above) if known[1] < 0 else (self.below, known)
        if self.below is None or self.above is None:
            self.place -= float(np.clip(known[1] / self.rate, -STRIDE, STRIDE))
            return abs(self.place) < FAREST
        (a, low), (b, high) = self.below, self.above
        self.place = a + (b - a) * float(np.clip(low / (low - high), EDGE, 1 - EDGE))
        return True
