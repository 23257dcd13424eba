"""A Core-XY stage in numbers, and what may be wrong with it: arrays for `simulator.py`.

Symbols and numbers of equations as in Yin et al. 2018, SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = Mapping[str, float]
REACH = 0.12  # [m] tables over position span -REACH to REACH
LOOSE_INERTIA, LOOSE_DRAG = 1e-6, 1e-4  # of a loose pulley [kg m^2, N m s]
CONTACT = 8.0  # [N m/rad] between a rotor and its loose pulley, where the numbers have no "contact"
YIN2018 = {"r": 5e-3, "mx": 0.1, "my": 0.2, "mp": 6e-3, "Jp": 1e-7, "AE": 880.0, "W": 0.24,
           "H": 0.3, "c": 0.06, "bx": 60.0, "by": 60.0, "fx": 0.2, "fy": 0.2, "Bp": 8e-4,
           "tf": 2e-4}  # fmt: skip
LIGHT_BENCH = YIN2018 | {"my": 0.25, "bx": 2.0, "by": 2.0, "fx": 0.3, "fy": 0.3, "Bp": 2e-5,
                         "tf": 5e-4}  # fmt: skip
SECTIONS = (  # (6), belt 1 from clip to clip, then belt 2: x, y, and pulleys with their signs
    (1, 0, {3: 1}), (0, -1, {3: 1, 1: 1}), (0, 0, {9: 1, 1: -1}),
    (0, 0, {9: 1, 8: -1}), (0, -1, {8: 1, 6: -1}), (-1, 0, {6: 1}),
    (1, 0, {4: 1}), (0, 1, {4: 1, 2: 1}), (0, 0, {10: 1, 2: -1}),
    (0, 0, {10: 1, 7: -1}), (0, 1, {7: 1, 5: -1}), (-1, 0, {5: 1}),
)  # fmt: skip


def _nothing() -> Array:
    return np.zeros((2, 2))


@dataclass(frozen=True, eq=False)
class Faults:
    """What is wrong with a stage; by default nothing.  ``back``: numbers that differ backwards;
    factors of belt sections, of single pulleys' dry and viscous friction; ``play`` [rad] (below 0:
    none) whose ends give softly over ``soft`` [rad]; forces [N] over position, from -``reach`` to
    ``reach`` [m]: ``pull``, ``spot`` (dry friction more); breakaway over Coulomb's friction, and
    the speed [m/s] over which it fades; drag over speed squared, ``windage`` [N s^2/m^2]; row by
    row: ``push`` [N], ``grip`` (factor of dry friction).  Pairs and (2, n) are for x and y.
    """

    back: Numbers = field(default_factory=dict)
    sections: tuple[float, ...] = (1.0,) * 12
    dry: Mapping[int, float] = field(default_factory=dict)
    drag: Mapping[int, float] = field(default_factory=dict)
    play: tuple[float, float] = (-1.0, -1.0)
    soft: float = 0.0
    pull: Array = field(default_factory=_nothing)
    spot: Array = field(default_factory=_nothing)
    breakaway: tuple[float, float] = (1.0, 1.0)
    fades: float = 0.01
    windage: tuple[float, float] = (0.0, 0.0)
    reach: float = REACH
    push: Array | None = None
    grip: Array | None = None


class Stage(NamedTuple):
    """A stage as the compiled step reads it; viscous and dry friction forward and backward."""

    table: Array
    stiffness: Array
    mass: Array
    viscous: Array
    dry: Array
    play: Array
    soft: float
    pull: Array
    spot: Array
    breakaway: Array
    fades: float
    windage: Array
    reach: float
    contact: float


def table(r: float) -> Array:
    """Rows of (6): stretch [m] of each section per x, y [m] and phi [rad]."""
    rows = [[x, y, *(r * signs.get(i, 0) for i in range(1, 11))] for x, y, signs in SECTIONS]
    return np.array(rows, float)


def stage(numbers: Numbers, faults: Faults) -> Stage:
    """Numbers and faults as arrays; k_i = A E / l_i at the centre."""
    n, loose = numbers, np.array([numbers.get("loose_drag", LOOSE_DRAG)] * 2 + [0.0] * 8)
    near, half = (n["W"] - n["c"]) / 2, n["H"] / 2
    lengths = np.array([near, half, n["H"], n["W"], half, near] * 2)
    factors = [[of.get(i, 1.0) for i in range(1, 11)] for of in (faults.drag, faults.dry)]
    drag, dry = n["Bp"] * np.array(factors[0]) + loose, n["tf"] * np.array(factors[1])
    ways = n, {**n, **faults.back}
    bridge = n["my"] + n["mx"] + 4 * n["mp"]
    return Stage(
        table(n["r"]),
        n["AE"] / lengths * np.array(faults.sections),
        np.array([n["mx"], bridge, *[LOOSE_INERTIA] * 2, *[n["Jp"]] * 8]),
        np.array([[w["bx"], w["by"], *drag] for w in ways]),
        np.array([[w["fx"], w["fy"], *dry] for w in ways]),
        *(np.array(faults.play), faults.soft, faults.pull, faults.spot),
        *(np.array(faults.breakaway), faults.fades, np.array(faults.windage)),
        *(faults.reach, n.get("contact", CONTACT)),
    )


def at_rest(phi: Array, r: float) -> Array:
    """(1), and the idlers where no section is stretched."""
    x, y = r * (phi[0] + phi[1]) / 2, r * (phi[0] - phi[1]) / 2
    turned = [-x, -x, x, x, x - y, x + y, x + y, x - y]
    return np.array([x, y, *phi, *(np.array(turned) / r)])
