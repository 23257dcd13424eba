"""A cause that can be seen: how much it changes over the noise, and the size that is asked for.

E0 is the sum of squares of what a cause changes in the recordings to fit, over their noise
(whitened, the mean removed where the zero is unknown), before anything is retuned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from benchmarks.shop.case import TRAIN
from benchmarks.shop.motions import Motion
from benchmarks.shop.stage import Array
from benchmarks.strange.cause import About, Cause, Draws
from benchmarks.strange.drive_causes import DRIVES, SENSORS
from benchmarks.strange.load_causes import LOADS
from benchmarks.strange.machines import Machine, Random, spread
from benchmarks.strange.running import Acts, all_moved
from benchmarks.strange.sensing import Sensor

CAUSES: tuple[Draws, ...] = LOADS + DRIVES + SENSORS
KINDS: tuple[tuple[Draws, ...], ...] = (LOADS, DRIVES, SENSORS)
NEEDS_ZERO = "constant_force"  # an unknown zero hides it
VISIBLE, FAINT = (3e3, 3e5), 500.0  # E0 that is asked for; below which a cause is drawn anew
TRIES, CLOSE, FARTHEST = 8, 0.2, 30.0  # of a size; of log E0; factor of one correction


@dataclass(frozen=True)
class Sized:
    """A cause at a size."""

    cause: Cause
    size: float
    evidence: float

    @property
    def acts(self) -> Acts:
        """What it does."""
        return self.cause.acts(self.size)

    @property
    def told(self) -> dict[str, Any]:
        """Effect, place, parameters and E0, as they are stored."""
        parameters = dict(self.cause.parameters(self.size))
        return {"effect": self.cause.name, "location": self.cause.location,
                "parameters": parameters, "E0": self.evidence}  # fmt: skip


def evidence_of(
    machine: Machine, motions: list[Motion], sensor: Sensor
) -> Callable[[Sensor, Cause, Acts], float]:
    """E0 of what a cause does, as a sensor shows it that differs in its zero at most."""
    train = motions[: len(TRAIN)]

    @cache
    def without(acts: Acts) -> list[Array]:
        return all_moved(machine, train, acts)

    def evidence(sees: Sensor, cause: Cause, acts: Acts) -> float:
        pairs = zip(all_moved(machine, train, acts), without(cause.without), strict=True)
        changes = (sees.whitened((a - b)[:: sensor.every]) for a, b in pairs)
        return float(sum((change**2).sum() for change in changes))

    return evidence


def sized(cause: Cause, target: float, evidence: Callable[[Acts], float]) -> Sized:
    """At E0 of about a target, or at the bound before it."""
    size = float(np.sqrt(np.prod(cause.bounds)))
    size = float(round(size)) if cause.whole else size
    for _ in range(TRIES):
        found = evidence(cause.acts(size))
        factor = np.clip(np.sqrt(target / max(found, 1e-9)), 1 / FARTHEST, FARTHEST)
        better = float(np.clip(size * factor, *cause.bounds))
        better = float(round(better)) if cause.whole else better
        if better == size or abs(np.log(factor)) < CLOSE / 2:
            break
        used, size = size, better
    else:
        return Sized(cause, used, found)
    return Sized(cause, size, found)


def concealed(
    random: Random,
    machine: Machine,
    motions: list[Motion],
    sensor: Sensor,
    among: tuple[Draws, ...] = CAUSES,
) -> tuple[Sized, Sensor]:
    """A cause of a size that is seen, and the sensor, which has a known zero where it must."""
    target, evidence = spread(random, *VISIBLE), evidence_of(machine, motions, sensor)
    while True:
        cause = among[int(random.integers(len(among)))](random, About(machine, motions))
        sees = replace(sensor, offsets=None) if cause.name == NEEDS_ZERO else sensor
        found = sized(cause, target, partial(evidence, sees, cause))
        if found.evidence >= FAINT:
            return found, sees


def concealed_both(
    random: Random,
    machine: Machine,
    motions: list[Motion],
    sensor: Sensor,
    kinds: tuple[tuple[Draws, ...], ...],
) -> tuple[tuple[Sized, ...], Sensor]:
    """Two causes of different ``kinds``, each seen if it were alone, and the sensor."""
    found: list[Sized] = []
    for kind in np.sort(random.choice(len(kinds), 2, replace=False)):
        one, sensor = concealed(random, machine, motions, sensor, kinds[kind])
        found.append(one)
    return tuple(found), sensor
