"""Stiffness of timing belts by type and width: A E = (A E per width) x width.

A belt alone is meant: clamps, idlers, frame and motors give way in series with it, so that what a
machine shows is softer, hence the wide prior of whoever uses this table.

Sources: [1] the data sheet value that `gt2_printer` uses, 19.4 kN for 6 mm; FarmBot accepts such a
belt where 10 kg stretch it by at most 1 % (genesis.farm.bot, belt: at least 9.8 kN).  [2] by the
moduli of the cords' fibres, aramid 70 GPa (Kevlar 29), E-glass 72 GPa, with the same section.
[3] aramid times 1.79, the ratio of steel to aramid cords in one belt (Gates Mectrol, flat belt F8:
19085 against 10635 N per mm of width).  [4] Yin et al. 2018: E = 160 MPa; 5.5 mm^2 of an MXL belt,
6 mm wide, are assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

from corexy_fmi.errors import InputError
from corexy_fmi.nearest import nearest

WIDTHS = (1e-3, 0.1)  # [m] that are believed
MOUNTS = 1.0  # [1] relative prior: a belt's mounts may take most of its stiffness


@dataclass(frozen=True)
class Belt:
    """A type of belt: A E over width [N/m], and where that is from."""

    name: str
    per_width: float
    source: str

    def stiffness(self, width: float) -> float:
        """A E [N] of a width [m]; raises InputError for one that no belt has."""
        low, high = WIDTHS
        if not low <= width <= high:
            raise InputError(f"belt width: found {width:g} m, expected {low:g} to {high:g} m")
        return self.per_width * width


BELTS = {
    belt.name: belt
    for belt in (
        Belt("gt2-glass", 19.4e3 / 6e-3, "data sheet of a glass-cord 2GT belt"),
        Belt("gt2-aramid", 19.4e3 / 6e-3 * 70 / 72, "gt2-glass by the moduli of aramid and glass"),
        Belt("gt2-steel", 19.4e3 / 6e-3 * 70 / 72 * 1.79, "gt2-aramid times 1.79, steel cords"),
        Belt("mxl", 880.0 / 6e-3, "Yin et al. 2018, 160 MPa; its section assumed"),
    )
}
USUAL = "gt2-glass"


def belt(name: str) -> Belt:
    """The belt of that name; raises InputError naming the nearest known one."""
    if name not in BELTS:
        known = ", ".join(BELTS)
        raise InputError(
            f"belt: found {name!r}, expected one of {known}, or an A E in N such as 19400"
            f"{nearest(name, BELTS)}"
        )
    return BELTS[name]
