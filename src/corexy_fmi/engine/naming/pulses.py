"""Pulses of force: `periodic_disturbance` in its other shape, where a run shows regular edges.

A sine is no first guess of pulses: after whitening, nearly all of a pulse is in its edges.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from corexy_fmi.effects.api import TWO_PI
from corexy_fmi.engine.fitting.fit import Fit, minimise, settle, white_noise
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.edges import Edge, edges
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

EFFECT, AXES = "periodic_disturbance", ("x", "y")
LEAST, EVEN = 3, 0.1  # pulses; share by which periods, widths and sizes may differ (median)
Mapper = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]


@dataclass(frozen=True)
class Train:
    """Equal pulses in time: size [N], frequency [Hz], the first edge upwards [s], duty [1]."""

    size: float
    frequency: float
    begin: float
    duty: float

    @property
    def phase(self) -> float:
        """Phase [rad] of `periodic_disturbance`, in (-pi, pi]."""
        turns = -self.frequency * self.begin
        return float(TWO_PI * (turns - np.round(turns)))


def train(found: Sequence[Edge]) -> Train | None:
    """The pulses that edges (in order of time) make up; None where they are not regular.

    A pulse is an edge upwards and the next one, if that goes down.
    """
    pulses = [(a, b) for a, b in pairwise(found) if a.size > 0 > b.size]
    if len(pulses) < LEAST:
        return None
    begins = np.array([a.time for a, _ in pulses])
    widths = np.array([b.time - a.time for a, b in pulses])
    sizes = np.array([(a.size - b.size) / 2 for a, b in pulses])
    period = float(np.median(np.diff(begins)))
    if not all(map(_even, (np.diff(begins), widths, sizes))) or np.median(widths) >= period:
        return None
    counts = np.round((begins - begins[0]) / period)
    period, first = np.polyfit(counts, begins, 1)
    return Train(
        float(np.median(sizes)), 1 / period, first, float(np.median(widths)) / float(period)
    )


def _even(values: Array) -> bool:
    """Whether most values are nearly the same."""
    middle = float(np.median(values))
    return float(np.median(np.abs(values - middle))) < EVEN * abs(middle)


def pulse_fits(base: Fit, singles: Sequence[Hypothesis], mapper: Mapper) -> list[Fit]:
    """Settled fits of pulses along every axis where the base's runs show a train of them."""
    known = {
        h.uses[0].location: h.uses[0] for h in singles if h.uses and h.uses[0].effect.name == EFFECT
    }
    pairs = [(known[a], _trains(base, a)) for a in AXES if a in known]
    return list(mapper(lambda pair: _fit(base, *pair), [p for p in pairs if any(p[1])]))


def _trains(base: Fit, axis: str) -> list[Train | None]:
    """For each run its pulses along an axis."""
    if not np.isfinite(base.cost):
        return []
    return [train(edges(base, r, axis)) for r in range(len(base.problem.runs))]


def _fit(base: Fit, instance: Instance, trains: Sequence[Train | None]) -> Fit:
    """The base refitted with pulses, from those that were seen.

    It begins at the retuned machine and at the machine as given, whose friction no pulses bent, and
    under white noise: the base's noise is coloured by the pulses, and would hide what is slow.
    """
    first = next(t for t in trains if t is not None)
    problem = replace(base.problem, hypothesis=Hypothesis((instance,), shaped=True))
    old = {x.key: base.u[k] for k, x in enumerate(base.problem.unknowns)}
    seen = {"amplitude": first.size, "frequency": first.frequency, "duty": first.duty}
    seen |= {
        f"phase@{run.name}": (t or first).phase for run, t in zip(problem.runs, trains, strict=True)
    }
    prefix = f"{instance.effect.name}.{instance.location}."
    starts = [
        [
            known.get(x.key, 0.0) if x.key in old else x.internal(seen[x.key.removeprefix(prefix)])
            for x in problem.unknowns
        ]
        for known in (old, {})
    ]
    own = base.u[len(base.problem.unknowns) :]
    rough = [minimise(problem, np.concatenate([start, own]), 2) for start in starts]
    fits = [minimise(white_noise(fit), fit.u) for fit in rough]
    return settle(min(fits, key=lambda fit: fit.cost))
