"""The numbers behind the verdicts on the named sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce import paths
from corexy_fmi.reproduce.claims import line_through
from corexy_fmi.reproduce.measure import MIDDLE, Measures
from corexy_fmi.reproduce.paper import EXPONENTS, FLOOR, SETTLING, SPEEDS
from corexy_fmi.reproduce.regime import regime
from corexy_fmi.reproduce.result import Cell, Table
from corexy_fmi.reproduce.sets import GROUPS, vectors, without_coulomb

MILLI = 1e3  # [mm/m], [ms/s]
Row = tuple[Cell, ...]


def evidence(names: Sequence[str], m: Measures, sets: Sequence[Mapping[str, float]]) -> Table:
    """What was measured of each named set; the last column is the specification's, for P1."""
    rows: list[Row] = []
    for turn in TURNS:
        error, gap = m.error["full", turn], m.error["full", turn] - m.error["4-DoF", turn]
        left = np.abs(line_through(error)[2]).max(axis=1) / np.abs(error).max(axis=1)
        shown = {f"{MILLI * v:g} mm/s": i for i, v in enumerate(SPEEDS)}
        rows += [
            (f"error {turn}, {speed} [mm]", *(MILLI * error[:, i]).tolist(), None)
            for speed, i in shown.items()
        ]
        rows += [
            (f"off a straight line, {turn}, of the largest", *left.tolist(), None),
            (f"full - 4-DoF {turn}, 79 mm/s [mm]", *(MILLI * gap[:, -1]).tolist(), None),
            (f"overshoot {turn}, 79 mm/s [mm]", *(MILLI * m.overshoot[turn][:, -1]).tolist(), None),
        ]
    rows += [
        (f"exponent of {group}, {turn}", *m.exponent[group, turn].tolist(), known)
        for turn in TURNS
        for group in GROUPS
        for known in [EXPONENTS[group] if turn == "x->y" else None]
    ]
    rows += [
        (f"settling after a pulse in {axis} [ms]", *(MILLI * s).tolist(), MILLI * SETTLING[axis])
        for axis, s in m.settling.items()
    ]
    regimes = [regime(p, MIDDLE) for p in sets]
    expected = {"zeta_x": 3.5, "zeta_y": 1.5}
    rows += [(key, *(r[key] for r in regimes), expected.get(key)) for key in regimes[0]]
    return Table("What was measured", ("quantity", *names, "reference, P1"), tuple(rows))


def pulses(parameters: Mapping[str, float]) -> Table:
    """(f) on P1: error of a corner in full steps, at the settling time and at twice that."""
    rows: list[Row] = []
    radius = parameters["pulley_radius"]
    for turn in TURNS:
        for word, p in (("with", parameters), ("without", without_coulomb(parameters))):
            for times in (1, 2):
                interval = times * SETTLING[turn[0]]
                corner = paths.by_pulses(turn, interval, radius)
                path = run_lanes(bundled_layout(), corner.excitation, vectors([p]))[0].T
                error = corner.error(path)
                floor = FLOOR[turn] if (word, times) == ("with", 2) else None
                share = error / paths.full_step(radius)
                rows.append((turn, word, MILLI * interval, MILLI * error, share, floor))
    head = ("turn", "Coulomb friction", "pulse every [ms]", "error [mm]", "of a full step",
            "reference [mm]")  # fmt: skip
    return Table("(f) on P1, pulses of a full step of both motors (0.157 mm)", head, tuple(rows))
