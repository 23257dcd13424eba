"""One task: the sets of a chunk drawn, run and measured; the same wherever it runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.sweep.measure import MEASURES, measured, windows
from corexy_fmi.sweep.plan import Plan
from corexy_fmi.sweep.vary import base_vector

Array = NDArray[np.float64]
Columns = dict[str, NDArray[np.generic]]
BLOCK = 32  # sets whose paths are in memory at once, a multiple of the lanes


def run_chunk(plan: Plan, index: int) -> Columns:
    """The table of a chunk: number of each set, what was drawn, what was measured; each (n,)."""
    drawn, drive = draw(plan, index), plan.excitation()
    values = np.tile(base_vector(plan.machine), (len(plan.rows(index)), 1))
    for r in plan.ranges:
        values[:, r.place.index] = drawn[r.place.key]
    corners, parts = windows(plan.shape, drive.time), []
    machine = plan.machine
    for first in range(0, len(values), BLOCK):
        paths = run_lanes(
            bundled_layout(),
            drive,
            values[first : first + BLOCK],
            fidelity=machine.fidelity,
            dc=machine.drive == "dc",
        )
        parts.append(measured(plan.shape, corners, drive.time, paths, plan.within))
    found = {name: np.concatenate([part[name] for part in parts]) for name in MEASURES}
    return {"set": np.array(plan.rows(index), dtype=np.int64), **drawn, **found}


def draw(plan: Plan, index: int) -> dict[str, Array]:
    """What is drawn for the sets of a chunk, by key, each (n,); seeded by seed and chunk."""
    random = np.random.default_rng([plan.seed, index])
    shares = random.random((len(plan.ranges), len(plan.rows(index))))
    return {r.place.key: r.at(share) for r, share in zip(plan.ranges, shares, strict=True)}
