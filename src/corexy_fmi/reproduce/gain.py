"""How near both 4-DoF models come to the full one: the paper's, and the condensed one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce import paths
from corexy_fmi.reproduce.measure import BLOCK, MIDDLE, RADIUS
from corexy_fmi.reproduce.result import Cell, Table
from corexy_fmi.reproduce.sets import Parameters, at_radius, vectors

Array = NDArray[np.float64]
SHORT = ("reduced", "condensed")
HEAD = ("sets", "turn", "4-DoF [mm]", "condensed [mm]", "share where condensed is nearer")


def distances(sets: Sequence[Parameters], turn: str) -> Array:
    """Largest distance [m] of each of `SHORT` from the full path at 39 mm/s, (2, sets)."""
    corner, _ = paths.at_speed(turn, MIDDLE, RADIUS)
    found = []
    for first in range(0, len(sets), BLOCK):
        values = vectors([at_radius(p, RADIUS) for p in sets[first : first + BLOCK]])
        full, *short = (
            run_lanes(bundled_layout(), corner.excitation, values, fidelity=fidelity)
            for fidelity in ("full", *SHORT)
        )
        found.append([np.hypot(*(path - full).transpose(1, 0, 2)).max(axis=1) for path in short])
    return np.concatenate(found, axis=1)


def gain(names: Sequence[str], named: Sequence[Parameters], sets: Sequence[Parameters]) -> Table:
    """Named sets one by one, drawn ones by their median."""
    rows: list[tuple[Cell, ...]] = []
    for turn in TURNS:
        apart = 1e3 * distances(named, turn)
        rows += [(name, turn, *apart[:, i].tolist(), None) for i, name in enumerate(names)]
        if len(sets):
            drawn = 1e3 * distances(sets, turn)
            nearer = float((drawn[1] < drawn[0]).mean())
            rows.append(("drawn, median", turn, *np.median(drawn, axis=1).tolist(), nearer))
    return Table("Largest distance from the full model's path, 39 mm/s", HEAD, tuple(rows))
