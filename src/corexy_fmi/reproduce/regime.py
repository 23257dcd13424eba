"""The regime of a parameter set: damping of both axes, who drags, and how fast it settles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.topology import FULL
from corexy_fmi.topology.corexy import equivalent_stiffness

Array = NDArray[np.float64]
PAIRS = ((3, 4), (5, 6), (7, 8), (9, 10))  # idlers that mirror each other
AXES = {"x": (0, 1), "y": (1, -1)}  # place in q, and the sign of the mirrored idler


def _pattern(axis: str) -> Array:
    """Columns (12, 5): the axis, and each pair of idlers moving alike (x) or oppositely (y)."""
    place, mirror = AXES[axis]
    columns = np.zeros((12, 5))
    columns[place, 0] = 1.0
    for column, (i, j) in enumerate(PAIRS, 1):
        columns[i + 1, column], columns[j + 1, column] = 1.0, mirror
    return columns


def slowest_pole(parameters: Mapping[str, float], axis: str) -> complex:
    """Slowest pole [1/s] of an axis with motors held, Coulomb friction left out."""
    constants, columns = FULL.constants(parameters, 0.0), _pattern(axis)
    mass, viscous = (
        columns.T @ (np.array(values)[:, None] * columns)
        for values in (constants.mass, constants.viscous)
    )
    stiffness = columns.T @ FULL.stiffness_matrix(dict(parameters)) @ columns
    n, inverse = len(mass), np.linalg.inv(mass)
    poles = np.linalg.eigvals(
        np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ viscous]])
    )
    return complex(poles[np.argmin(np.abs(poles))])


def damping(parameters: Mapping[str, float], axis: str) -> float:
    """Modal damping ratio: (p/w + w/p)/2 of the slowest pole p where it is real, w^2 = k/m."""
    pole, p = slowest_pole(parameters, axis), parameters
    if abs(pole.imag) > 1e-9 * abs(pole):
        return -pole.real / abs(pole)
    idlers = 4 * p["pulley_inertia"] / p["pulley_radius"] ** 2
    mass = p["carriage_mass"] + idlers
    if axis == "y":
        mass += p["bridge_mass"] + 4 * p["pulley_mass"]
    natural = np.sqrt(2 * equivalent_stiffness(p) / mass)
    return float((abs(pole) / natural + natural / abs(pole)) / 2)


def regime(parameters: Mapping[str, float], speed: float) -> dict[str, float]:
    """What may decide a claim: damping ratios and shares of the drag at a speed [m/s]."""
    p, r = parameters, parameters["pulley_radius"]
    found = {f"zeta_{axis}": damping(p, axis) for axis in AXES}
    for axis, part in (("x", "carriage"), ("y", "bridge")):
        guide, dry = p[f"{part}_viscous_friction"], p[f"{part}_coulomb_friction"]
        count = 8 if axis == "x" else 4  # idlers that turn
        rolling = count * p["pulley_viscous_friction"] / r**2
        coulomb = dry + count * p["pulley_coulomb_friction"] / r
        found[f"idler_share_{axis}"] = rolling / (rolling + guide)
        found[f"coulomb_share_{axis}"] = coulomb / (coulomb + speed * (rolling + guide))
    return found
