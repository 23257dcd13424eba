"""Causes in belts, and the run-out of an idler.  A docstring has the unit of a size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.shop.motions import angles
from benchmarks.shop.simulator import simulate
from benchmarks.shop.stage import Array, Faults, stage
from benchmarks.strange.beside import Beside, Runout
from benchmarks.strange.cause import About, Cause, Parameters
from benchmarks.strange.machines import Random, spread
from benchmarks.strange.matrices import TENSE
from benchmarks.strange.running import Acts, grid


def pulls(about: About, n: int) -> Array:
    """Of a healthy stage's sections [N] in a recording, over fine time."""
    machine, (time, xy) = about.machine, about.motions[n]
    fine, _, _ = grid(time)
    phi = angles(xy, machine.numbers["r"])
    played = np.column_stack([np.interp(fine, time, p) for p in phi.T])
    step = machine.step(loose=False)
    states, _ = simulate(fine, played, machine.numbers, None, step)
    of = stage(machine.numbers, Faults())
    return (states @ of.table.T) * of.stiffness * np.array(TENSE)


def _belts(
    name: str,
    bounds: tuple[float, float],
    told: Callable[[float], Parameters],
    beside: Callable[[float], Beside],
) -> Cause:
    """A cause in all sections of both belts."""
    return Cause(name, "belts", bounds, told, lambda size: Acts(beside=beside(size)))


def _belt_stiffness_vs_position(random: Random, about: About) -> Cause:
    """Share of a section's true change of length [1]; 1 is a real belt."""
    return _belts("belt_stiffness_vs_position", (1e-3, 1.0), lambda s: {"strength": s},
                  lambda s: Beside(strength=s))  # fmt: skip


def _belt_hardening(random: Random, about: About) -> Cause:
    """Tangent stiffness more per strain, whatever its sign [1]."""
    return _belts("belt_hardening", (1.0, 300.0), lambda s: {"coefficient": s},
                  lambda s: Beside(hardening=s))  # fmt: skip


def _belt_slack(random: Random, about: About) -> Cause:
    """A healthy stage's highest loss of tension in the recordings to fit over the pretension, less
    one, squared [1]: what it changes goes up with that.
    """
    most = float(max(-pulls(about, n).min() for n in range(2)))

    def holds(size: float) -> float:
        return most / (1 + float(np.sqrt(size)))

    return _belts("belt_slack", (1e-4, 25.0), lambda s: {"pretension": holds(s)},
                  lambda s: Beside(pretension=holds(s)))  # fmt: skip


def _belt_damping(random: Random, about: About) -> Cause:
    """Of k (e + time e') [s]."""
    return _belts("belt_damping", (1e-5, 1e-2), lambda s: {"time": s}, lambda s: Beside(damping=s))


def _belt_relaxation(random: Random, about: About) -> Cause:
    """Stiffness of the Maxwell arm over that which stays [1]; told as its share of both."""
    constant = spread(random, 0.02, 2.0)
    return _belts("belt_relaxation", (5e-3, 2.0),
                  lambda s: {"ratio": s / (1 + s), "time_constant": constant},
                  lambda s: Beside(arm=s, relaxes=constant))  # fmt: skip


def _pulley_eccentricity(random: Random, about: About) -> Cause:
    """Half of the run-out of an idler, peak to peak [m]."""
    idler, phase = int(random.integers(3, 11)), float(random.uniform(-np.pi, np.pi))
    return Cause("pulley_eccentricity", f"pulley{idler}", (2e-6, 1e-3),
                 lambda s: {"amplitude": s, "phase": phase},
                 lambda s: Acts(beside=Beside(runout=Runout(idler, s, phase))))  # fmt: skip


BELTS = (
    _belt_stiffness_vs_position, _belt_hardening, _belt_slack, _belt_damping, _belt_relaxation,
    _pulley_eccentricity,
)  # fmt: skip
