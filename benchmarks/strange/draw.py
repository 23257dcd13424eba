"""A whole case from a seed: machine, motions, sensor, and nothing or one cause of a drawn size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.shop.case import Truth, named, nothing
from benchmarks.shop.motions import Motion, angles
from benchmarks.shop.stage import Array
from benchmarks.strange.machines import Machine, Random, draw_machine, machine_file
from benchmarks.strange.moves import draw_motions
from benchmarks.strange.running import HEALTHY, Acts, moved
from benchmarks.strange.sensing import Sensor, draw_sensor
from benchmarks.strange.sizes import Sized, concealed

NULLS = 0.3  # share of cases with nothing wrong
Told = dict[str, Any]


@dataclass(frozen=True)
class Drawn:
    """``file``: the machine file's text; ``tables``: columns of each recording; ``found``: what is
    concealed, None where nothing is.
    """

    seed: int
    machine: Machine
    file: str
    sensor: Sensor
    motions: list[Motion]
    found: Sized | None
    tables: list[dict[str, Array]]

    @property
    def truth(self) -> Told:
        """Effect, place, parameters and E0 of what is concealed, as it is stored."""
        if self.found is None:
            return {"effect": None, "location": None, "parameters": {}, "E0": 0.0}
        cause = self.found.cause
        parameters = dict(cause.parameters(self.found.size))
        return {"effect": cause.name, "location": cause.location, "parameters": parameters,
                "E0": self.found.evidence}  # fmt: skip


def generator(seed: int, part: int) -> Random:
    """Random numbers of one part of a case, whatever the others draw."""
    return np.random.default_rng([seed, part])


def truth_of(told: Told) -> Truth:
    """What may be said of a case, by what is stored of it."""
    if told["effect"] is None:
        return nothing()
    return named(told["location"], [(told["effect"], told["location"])])


def _table(sensor: Sensor, motion: Motion, radius: float, seen: Array) -> dict[str, Array]:
    """Columns of a recording; blank between samples."""
    time, xy = motion
    logged, told = angles(xy, radius), np.full(xy.shape, np.nan)
    told[:: sensor.every] = seen
    return {"time": time, "phi1": logged[:, 0], "phi2": logged[:, 1],
            "x": told[:, 0], "y": told[:, 1]}  # fmt: skip


def _tables(
    seed: int, machine: Machine, sensor: Sensor, motions: list[Motion], acts: Acts
) -> list[dict[str, Array]]:
    """Each recording as the sensor shows it."""
    random, tables = generator(seed, 4), []
    for n, motion in enumerate(motions):
        xy = moved(machine, n, motion, acts)[:: sensor.every]
        off = 0.0 if sensor.offsets is None else sensor.offsets[n]
        seen = sensor.seen(xy + off, random)
        tables.append(_table(sensor, motion, machine.numbers["r"], seen))
    return tables


def draw(seed: int) -> Drawn:
    """The case of a seed, always the same."""
    machine, sensor = draw_machine(generator(seed, 0)), draw_sensor(generator(seed, 1))
    motions = draw_motions(generator(seed, 2), machine, sensor.row)
    random, found = generator(seed, 3), None
    if random.random() >= NULLS:
        found, sensor = concealed(random, machine, motions, sensor)
    acts = HEALTHY if found is None else found.acts
    tables = _tables(seed, machine, sensor, motions, acts)
    text = machine_file(machine.numbers, generator(seed, 5))
    return Drawn(seed, machine, text, sensor, motions, found, tables)
