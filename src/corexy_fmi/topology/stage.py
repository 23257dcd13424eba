"""A stage is a table: what moves, which belt sections join it, and the constants of both.

T = sum m_i q_i'^2 / 2, V = sum k_s e_s^2 / 2 with the elongation e_s = row_s . u, where u holds
x, y [m] and the belt travel r phi_i [m] of every pulley (Yin et al. 2018, eqs (4), (6), (7)).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from corexy_fmi.parameters import NOMINAL
from corexy_fmi.topologies import TOPOLOGIES

X, Y, FIRST_PULLEY = 0, 1, 2  # places in q: x, y, then phi_1 ..


@dataclass(frozen=True)
class Section:
    """One belt section: its elongation's row, tension positive, and how its length moves.

    ``row`` maps coordinates ("x", "y", "phi3") to signed weights on [m] of travel; ``length`` gives
    the change of the section's length over x and y; ``side`` is -1 at the bridge's left end, +1 at
    its right end, 0 elsewhere.
    """

    name: str
    belt: int
    row: Mapping[str, int]
    length_slope: tuple[int, int] = (0, 0)
    side: int = 0

    @property
    def yaw_arm(self) -> int:
        """How a counter-clockwise yaw of the bridge lengthens the section: -1, 0 or 1."""
        return self.side * self.row.get("y", 0)


@dataclass(frozen=True)
class Constants:
    """Values that follow from the machine's parameters; each a scalar, array or SymPy expression.

    mass [kg or kg m^2], viscous [N s/m or N m s/rad] and coulomb [N or N m] for each coordinate;
    stiffness [N/m] and length [m] at the centre for each section; damping_time [s] of all sections
    where it is not the parameter ``belt_damping_time``.
    """

    mass: tuple[Any, ...]
    viscous: tuple[Any, ...]
    coulomb: tuple[Any, ...]
    stiffness: tuple[Any, ...]
    length: tuple[Any, ...]
    damping_time: Any = None


@dataclass(frozen=True)
class Stage:
    """A topology: names of the coordinates, the sections, and the constants' equations.

    ``constants(parameters, dc)`` takes the nominal parameters by name and ``dc`` (1 with a dc
    drive, else 0).  ``rest`` is x and y over the two motors' travel where nothing pulls, eq. (1);
    ``direct`` says which motors are rigidly fixed to their axis (1 to x, 2 to y).
    """

    name: str
    coordinates: tuple[str, ...]
    sections: tuple[Section, ...]
    constants: Callable[[Mapping[str, Any], Any], Constants]
    topology: str = "corexy"
    rest: tuple[tuple[float, float], tuple[float, float]] = ((0.5, 0.5), (0.5, -0.5))
    direct: tuple[bool, bool] = (False, False)

    @property
    def dynamic(self) -> bool:
        """Whether it has masses at all."""
        return bool(self.sections) or any(self.direct)

    def names(self) -> list[str]:
        """Name of each place of the kernel's vector; empty where the topology has no parameter."""
        held = {p.place: p.name for p in TOPOLOGIES[self.topology].parameters}
        return [held.get(place, "") for place in range(len(NOMINAL))]

    def path(self, radius: float, phi1: Any, phi2: Any) -> tuple[Any, Any]:
        """x, y [m] at which motor angles [rad] hold the stage, eq. (1)."""
        (a, b), (c, d) = self.rest
        return radius * (a * phi1 + b * phi2), radius * (c * phi1 + d * phi2)

    def rows(self, radius: float) -> np.ndarray:
        """Elongation [m] of each section for a unit of each coordinate, (sections, coordinates)."""
        scale = [1.0 if c in "xy" else radius for c in self.coordinates]
        weights = [[s.row.get(c, 0) for c in self.coordinates] for s in self.sections]
        return np.array(weights, dtype=float).reshape(-1, len(self.coordinates)) * scale

    def stiffness_matrix(self, parameters: Mapping[str, float], dc: bool = False) -> np.ndarray:
        """Second derivative of V [N/m, N/rad, N m/rad], symmetric by construction."""
        rows = self.rows(parameters["pulley_radius"])
        k = np.array(self.constants(parameters, float(dc)).stiffness, dtype=float)
        return rows.T @ (k[:, None] * rows)
