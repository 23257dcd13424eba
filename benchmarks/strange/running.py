"""A drawn machine under its motion, with or without what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.shop.motions import Motion, angles
from benchmarks.shop.simulator import simulate
from benchmarks.shop.stage import Array, Faults
from benchmarks.strange.beside import Beside
from benchmarks.strange.bodies import reported
from benchmarks.strange.bodies import simulate as simulate_beside
from benchmarks.strange.loop import Drive, Ran
from benchmarks.strange.loop import simulate as simulate_loop
from benchmarks.strange.machines import Machine
from benchmarks.strange.matrices import step_of

NEUTRAL, SOUND = Faults(), Drive()
FINE, SETTLES = 5e-4, 1.0  # [s]: between simulated rows at most; held before a recording begins
Changes = Callable[[int, Array, Array], Array]  # recording, time [s], values -> values


def _healthy(n: int, time: Array) -> Faults:
    return Faults()


def _same(n: int, time: Array, values: Array) -> Array:
    return values


@dataclass(frozen=True)
class Acts:
    """What a cause does: faults of a stage over time [s], motor angles [rad] that are played
    instead of the logged ones, places [m] that are reported instead of the true ones; what is wrong
    with dc drives; what is beside a stage with steppers, which then has none of these faults.
    """

    faults: Callable[[int, Array], Faults] = _healthy
    played: Changes = _same
    shown: Changes = _same
    loose: bool = False  # a pulley turns on its shaft
    drive: Drive = SOUND
    beside: Beside | None = None


HEALTHY = Acts()


def both(one: Acts, two: Acts) -> Acts:
    """What two causes of different kinds do; of axes, drives and the sensor, the one on the earlier
    comes first.
    """
    return Acts(
        lambda n, time: _merged(one.faults(n, time), two.faults(n, time)),
        lambda n, time, phi: two.played(n, time, one.played(n, time, phi)),
        lambda n, time, xy: two.shown(n, time, one.shown(n, time, xy)),
        one.loose or two.loose,
        one.drive if two.drive is SOUND else two.drive,
    )


def _merged(one: Faults, two: Faults) -> Faults:
    """One's faults, and what two does to belts and play."""
    own = {name: getattr(two, name) for name in ("sections", "play", "soft")}
    done = {name: value for name, value in own.items() if value != getattr(NEUTRAL, name)}
    return replace(one, **done)  # type: ignore[arg-type]


def grid(time: Array) -> tuple[Array, int, int]:
    """Fine times [s] that hold all rows: where the first row is among them, how far to the next."""
    row = float(time[1] - time[0])
    parts = int(np.ceil(row / FINE))
    before = int(np.ceil(SETTLES * parts / row))
    count = before + (len(time) - 1) * parts + 1
    return (np.arange(count, dtype=np.float64) - before) * (row / parts), before, parts


def moved(machine: Machine, n: int, motion: Motion, acts: Acts, finer: float = 1.0) -> Array:
    """x and y [m] that are reported without noise at each row; angles are linear between rows, and
    before the first the stage comes to rest.  ``finer`` divides the simulator's step.
    """
    if machine.dc:
        return looped(machine, n, motion, acts, finer).xy
    time, xy = motion
    fine, before, parts = grid(time)
    radius = machine.numbers["r"]
    phi = np.column_stack([np.interp(fine, time, p) for p in angles(xy, radius).T])
    played, numbers, beside = acts.played(n, fine, phi), machine.numbers, acts.beside
    if beside is not None:
        step = step_of(numbers, beside) / finer
        places = reported(simulate_beside(fine, played, numbers, beside, step)[0])
    else:
        step = machine.step(loose=acts.loose) / finer
        places = simulate(fine, played, numbers, acts.faults(n, fine), step)[0][:, :2]
    return acts.shown(n, fine, places)[before::parts]


def looped(machine: Machine, n: int, motion: Motion, acts: Acts, finer: float = 1.0) -> Ran:
    """The same of a stage with dc motors, where angles are references, with voltages [V] and
    rotors' angles [rad] at each row.
    """
    time, xy = motion
    fine, before, parts = grid(time)
    ref = np.column_stack([np.interp(fine, time, p) for p in angles(xy, machine.numbers["r"]).T])
    ran = simulate_loop(
        fine, ref, machine.numbers, acts.faults(n, fine), acts.drive,
        machine.step(loose=acts.loose) / finer, parts, before % parts,
    )  # fmt: skip
    rows = slice(before, None, parts)
    return Ran(acts.shown(n, fine, ran.xy)[rows], ran.volts[rows], ran.rotors[rows])


def all_moved(
    machine: Machine, motions: Sequence[Motion], acts: Acts, finer: float = 1.0
) -> list[Array]:
    """Of every recording."""
    return [moved(machine, n, motion, acts, finer) for n, motion in enumerate(motions)]
