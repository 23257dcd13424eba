"""Micro-steps of a fit: what its machine needs, and its effects where they begin."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np

from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.kernel.call import Array, step_limit
from corexy_fmi.kernel.law_code import written
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.machine import Machine

SHORTEST = 12.0  # times that an effect may shorten the micro-step of a fit
STABLE, HALVINGS = 2.0, 5  # steps beyond the own one of damped belts that are stable; at most
AT_EASE = 2.0  # times that the step of an effect's pole may be lengthened, but a rotor's


def needed(
    layout: Layout, machine: Machine, base: Array, hypothesis: Hypothesis, coarse: float
) -> float:
    """Micro-step [s] that the effects need where they begin; infinite without such.

    ``coarse`` lengthens it up to `AT_EASE` times, but not that of a rotor on its field: it swings
    fast over detents, and steps twice as long were 70 nats off.  Effects that damp belts are left
    out: their steps follow from the damping at hand (`damped`).
    """
    steps = [np.inf]
    for instance in hypothesis.uses:
        if not damps(instance):
            found = _needed_by(layout, machine, base, instance)
            ease = 1.0 if instance.effect.frees_rotor else AT_EASE
            steps += [min(coarse, ease) * h for h in found]
    return float(min(steps))


def damped(
    layout: Layout, machine: Machine, vectors: Array, sizes: list[int], limit: float
) -> float:
    """Micro-step [s] for these vectors (sets, n), whose belts are damped by the numbers at
    ``sizes``: ``limit`` halved until the rates that each set extrapolates stay stable; idlers of a
    less damped one may be the faster, for they are not tied yet.
    """
    some = vectors[(vectors[:, sizes] > 0).any(axis=1)]
    if not len(some):
        return limit
    steps = [own_step(layout, v.tobytes(), machine.stage, machine.drive) for v in some]
    need = STABLE * min(steps)
    return limit / 2.0 ** min(max(np.ceil(np.log2(limit / need)), 0.0), HALVINGS)


@lru_cache(maxsize=1024)
def damps(instance: Instance) -> bool:
    """Whether an effect damps belts."""
    laws = [law for law in instance.effect.laws if law.port == "belt"]
    return any("belt_time" in written(instance.effect, law) for law in laws)


def _needed_by(layout: Layout, machine: Machine, base: Array, instance: Instance) -> list[float]:
    """The same of each start of one effect, where it brings a pole or stiffens belts."""
    if not (instance.effect.pole or any(law.port == "belt" for law in instance.effect.laws)):
        return []
    values = [p.starts for p in instance.effect.parameters]
    sets: list[Array] = []
    for row in itertools.islice(itertools.product(*values), 24):
        sets.append(base.copy())
        sets[-1][instance.parameter : instance.parameter + len(row)] = row
    return [own_step(layout, v.tobytes(), machine.stage, machine.drive) for v in sets]


@lru_cache(maxsize=4096)
def own_step(layout: Layout, vector: bytes, fidelity: str, drive: str) -> float:
    """Micro-step [s] that a parameter vector needs by itself."""
    values = np.frombuffer(vector)
    return step_limit(layout, values, fidelity=fidelity, dc=drive == "dc")
