"""pysindy's sparse regression on responses: this kernel's own answers to every effect as library.

More than a user of pysindy would have: each candidate is what the kernel says that a small effect
at a place adds to x and y, and what a nominal parameter does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from benchmarks.rivals.common import Array, Ground, Part, corrected
from benchmarks.rivals.library import NOMINAL
from benchmarks.rivals.sparse import SETTINGS, Setting, beside, criterion
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.parameters import PLACES
from corexy_fmi.simulate import excitation, machine_vector

STARTS, NUDGE = 8, 0.02  # starts of an effect at most; relative change of a nominal parameter
Label = tuple[str, str]


def candidates(machine: Machine) -> Iterator[tuple[Label, Array]]:
    """(effect, place) and the kernel's vector of a machine with a little of it."""
    layout, base = bundled_layout(), machine_vector(machine)
    for name, std in machine.rel_std.items():
        if std > 0 and machine.parameters[name] > 0:
            vector = base.copy()
            vector[PLACES[name]] *= 1 + NUDGE
            yield (NOMINAL, name), vector
    for instance in instances(layout, machine):
        starts = product(*(p.starts for p in instance.effect.parameters))
        for _, values in zip(range(STARTS), starts, strict=False):
            vector = base.copy()
            vector[instance.parameter : instance.parameter + len(values)] = values
            yield (instance.effect.name, instance.location), vector


def response_matrix(machine: Machine, part: Part, vectors: Sequence[Array]) -> Array:
    """What each vector adds to x and y at the samples, (samples of x then y, vectors) [m]."""
    drive, layout = excitation(machine, part.recording), bundled_layout()
    base = run_lanes(layout, drive, machine_vector(machine)[None])[0]
    sampled = part.used.T
    out = []
    for first in range(0, len(vectors), 8):
        for change in run_lanes(layout, drive, np.array(vectors[first : first + 8])) - base:
            columns = [c[s] - c[s].mean() for c, s in zip(change, sampled, strict=True)]
            out.append(np.concatenate(columns))
    return np.column_stack(out)


def _left(part: Part) -> Array:
    return np.concatenate([c[u] for c, u in zip(part.left.T, part.used.T, strict=True)])


def _spread(part: Part, values: Array) -> Array:
    out = np.full(part.left.T.shape, np.nan)
    out[part.used.T] = values
    return out.T


def responses(ground: Ground) -> dict[str, Any]:
    """The setting is chosen by information criterion on the training recordings."""
    labels, vectors = map(list, zip(*candidates(ground.machine), strict=True))
    parts = (*ground.train, *ground.holdout)
    columns = [response_matrix(ground.machine, p, vectors) for p in parts]
    whole = [np.isfinite(c).all(axis=0) & (np.abs(c).max(axis=0) < 0.1) for c in columns]
    usable, nominal = np.all(whole, axis=0), np.array([n == NOMINAL for n, _ in labels])
    train = [
        (p, c[:, usable]) for p, c in zip(ground.train, columns[: len(ground.train)], strict=True)
    ]
    late = [
        (p, c[:, usable]) for p, c in zip(ground.holdout, columns[len(ground.train) :], strict=True)
    ]

    def terms(pairs: list[tuple[Part, Array]], setting: Setting) -> Array:
        theta = np.concatenate([c for _, c in pairs])
        lacking = np.concatenate([_left(p) for p, _ in pairs])[:, None]
        return beside(theta, lacking, nominal[usable], setting)[0]

    def left_by(found: Array, pairs: list[tuple[Part, Array]]) -> float:
        return corrected([p for p, _ in pairs], [_spread(p, c @ found) for p, c in pairs])

    count = sum(len(_left(p)) for p, _ in train)
    tried = [(t, terms(train, t)) for t in SETTINGS]
    setting, found = min(tried, key=lambda one: criterion(left_by(one[1], train), count, one[1]))
    kept = [label for label, use in zip(labels, usable, strict=True) if use]
    active = sorted({n for n, f in zip(kept, found, strict=True) if f and n[0] != NOMINAL})
    return {
        "rms": left_by(found, late),
        "named": sorted({name for name, _ in active}),
        "terms": [f"{name} at {place}" for name, place in active],
        "setting": f"{setting}, of {len(kept)} candidates",
    }
