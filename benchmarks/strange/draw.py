"""A whole case from a seed: machine, motions, sensor, and nothing, a cause or two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from benchmarks.shop.case import Truth, named, nothing
from benchmarks.shop.motions import Motion, angles
from benchmarks.shop.stage import Array
from benchmarks.strange.cause import Draws
from benchmarks.strange.dc_causes import DC_CAUSES, DC_KINDS
from benchmarks.strange.loop import Ran
from benchmarks.strange.machines import Machine, Random, draw_machine, machine_file
from benchmarks.strange.motors import with_motors
from benchmarks.strange.moves import draw_motions
from benchmarks.strange.rest_causes import REST
from benchmarks.strange.running import HEALTHY, Acts, both, looped, moved
from benchmarks.strange.sensing import Sensor, draw_sensor
from benchmarks.strange.sensing import looped as beside_a_loop
from benchmarks.strange.sizes import CAUSES, KINDS, Sized, concealed, concealed_both

# first cases: of two causes, with dc motors, of the rest, of two causes with dc motors
PAIRS, LOOPS, OTHERS, LOOPED_PAIRS = 1000, 2000, 3000, 4000
NULLS = 0.3  # share of cases with nothing wrong, where no two causes are asked for
TWO = "two"
Told = dict[str, Any]


@dataclass(frozen=True)
class Drawn:
    """``file``: the machine file's text; ``tables``: columns of each recording; ``found``: what is
    concealed.
    """

    seed: int
    machine: Machine
    file: str
    sensor: Sensor
    motions: list[Motion]
    found: tuple[Sized, ...]
    tables: list[dict[str, Array]]

    @property
    def truth(self) -> Told:
        """Effect, place, parameters and E0 of what is concealed, as it is stored; of two causes
        each, and the lower E0.
        """
        if not self.found:
            return {"effect": None, "location": None, "parameters": {}, "E0": 0.0}
        each = [one.told for one in self.found]
        if len(each) == 1:
            return each[0]
        least = min(one["E0"] for one in each)
        return {"effect": TWO, "location": None, "effects": each, "E0": least}


def generator(seed: int, part: int) -> Random:
    """Random numbers of one part of a case, whatever the others draw."""
    return np.random.default_rng([seed, part])


def truth_of(told: Told) -> Truth:
    """What may be said of a case, by what is stored of it."""
    if told["effect"] is None:
        return nothing()
    each = [(one["effect"], one["location"]) for one in told.get("effects", [told])]
    return named(" ".join(place for _, place in each), each)


def _table(sensor: Sensor, motion: Motion, radius: float, seen: Array) -> dict[str, Array]:
    """Columns of a recording; blank between samples."""
    time, xy = motion
    logged, told = angles(xy, radius), np.full(xy.shape, np.nan)
    told[:: sensor.every] = seen
    return {"time": time, "phi1": logged[:, 0], "phi2": logged[:, 1],
            "x": told[:, 0], "y": told[:, 1]}  # fmt: skip


def _with_motors(sensor: Sensor, columns: dict[str, Array], ran: Ran) -> dict[str, Array]:
    """And what the loop asked for, and encoders showed."""
    shown = {"V": ran.volts} | ({"phi": sensor.counted(ran.rotors)} if sensor.counts else {})
    end = {"V": "", "phi": "_meas"}
    return columns | {
        f"{name}{a + 1}{end[name]}": both[:, a] for name, both in shown.items() for a in range(2)
    }


def _tables(
    seed: int, machine: Machine, sensor: Sensor, motions: list[Motion], acts: Acts
) -> list[dict[str, Array]]:
    """Each recording as the sensor shows it."""
    random, tables = generator(seed, 4), []
    for n, motion in enumerate(motions):
        ran = looped(machine, n, motion, acts) if machine.dc else None
        xy = ran.xy if ran else moved(machine, n, motion, acts)
        off = 0.0 if sensor.offsets is None else sensor.offsets[n]
        seen = sensor.seen(xy[:: sensor.every] + off, random)
        columns = _table(sensor, motion, machine.numbers["r"], seen)
        tables.append(_with_motors(sensor, columns, ran) if ran else columns)
    return tables


def acts_of(found: Sequence[Sized]) -> Acts:
    """What all causes do together."""
    return reduce(both, [one.acts for one in found]) if found else HEALTHY


def drawn(number: int, seed: int) -> Drawn:
    """The case of a number, which tells of what kind it is."""
    two = PAIRS <= number < LOOPS or number >= LOOPED_PAIRS
    rest = OTHERS <= number < LOOPED_PAIRS
    return draw(seed, two, has_loop(number), REST if rest else None)


def has_loop(number: int) -> bool:
    """Whether the case of a number has dc motors."""
    return LOOPS <= number < OTHERS or number >= LOOPED_PAIRS


def _turned(
    random: Random, machine: Machine, stages: Random, sensor: Sensor
) -> tuple[Machine, Sensor]:
    """A stage with dc motors, another where none suit it; the sensor beside their loop."""
    sensor = beside_a_loop(random, sensor)
    while (turned := with_motors(random, machine, sensor.row)) is None:
        machine = draw_machine(stages)
    return turned, sensor


def draw(
    seed: int, two: bool = False, dc: bool = False, among: tuple[Draws, ...] | None = None
) -> Drawn:
    """The case of a seed, always the same; with ``two`` causes of different kinds, turned by
    ``dc`` motors; with a cause ``among`` others than the usual ones.
    """
    stages, sensor = generator(seed, 0), draw_sensor(generator(seed, 1))
    machine = draw_machine(stages)
    if dc:
        machine, sensor = _turned(generator(seed, 6), machine, stages, sensor)
    motions = draw_motions(generator(seed, 2), machine, sensor.row)
    random = generator(seed, 3)
    found: tuple[Sized, ...] = ()
    if two:
        kinds = DC_KINDS if dc else KINDS
        found, sensor = concealed_both(random, machine, motions, sensor, kinds)
    elif random.random() >= NULLS:
        usual = DC_CAUSES if dc else CAUSES
        one, sensor = concealed(random, machine, motions, sensor, among or usual)
        found = (one,)
    tables = _tables(seed, machine, sensor, motions, acts_of(found))
    text = machine_file(machine.numbers, generator(seed, 5))
    return Drawn(seed, machine, text, sensor, motions, found, tables)
