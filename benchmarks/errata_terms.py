"""The printed eqs (8), (10), (12), (14) of Yin et al. 2018 against Lagrange's equations, in SymPy.

The printed page is not in this repository.  Of (10), (12), (14) the project's notes say what is
printed; of the idler rows of (8) only the letters are known (which stiffness stands at which
coordinate, from a text extraction that has lost its signs) and two facts: on `yin2018` the stage
rests at dx/d(r phi_1) = 0.21, and on `light_bench` it diverges.  `reconstructions` tries every
choice of signs that does not depend on the pulley, as one printed line for all pulleys must, and
keeps those that agree with both facts.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from benchmarks.exact_stage import lagrange, matrices, section_stiffness

Array = NDArray[np.float64]
Signs = tuple[int, int, int, int]  # of x, y, phi_s in rows 3-6, and of y in rows 7-10
FREE, MOTORS = [0, 1, *range(4, 12)], [2, 3]
IDLERS = range(3, 11)
REST, NEAR = 0.21, 0.005  # dx/d(r phi_1) of the printed (8) on yin2018, as noted, and its rounding


def symbols() -> tuple[tuple[Any, ...], Any, dict[int, Any]]:
    """Coordinates (12,), r, and k_1 .. k_5 by number."""
    q, _, constants = lagrange()[1]
    return q, constants[0], dict(enumerate(constants[5:], 1))


def derived(i: int) -> Any:
    """Elastic force on pulley i from (6): -dV/dphi_i [N m]."""
    q, v, _ = lagrange()[1]
    return sympy.expand(-sympy.diff(v, q[i + 1]))


def printed_motor(i: int) -> Any:
    """Elastic terms of (10) as printed, one sign of y for both motors."""
    q, r, k = symbols()
    phi = dict(enumerate(q[2:], 1))
    turns = k[3] * phi[i + 8] - k[2] * phi[i + 2] - (k[2] + k[3]) * phi[i]
    return sympy.expand(r * k[2] * q[1] + r**2 * turns)


def printed_idler(i: int, signs: Signs) -> Any:
    """Elastic terms of the idler rows of (8) with given signs; the letters are the printed ones."""
    q, r, k = symbols()
    phi = dict(enumerate(q[2:], 1))
    a, b, c, d = signs
    if i <= 6:
        n, s = (2, i - 2) if i <= 4 else (5, i + 2)
        near = a * r * k[1] * q[0] + b * r * k[n] * q[1] + c * r**2 * k[1] * phi[s]
        return sympy.expand(near - (k[1] + k[n]) * r**2 * phi[i])
    m, n, s, t = (4, 5, 17 - i, i - 2) if i <= 8 else (3, 4, i - 8, 17 - i)
    turns = r**2 * (k[m] * phi[s] + k[n] * phi[t])
    return sympy.expand(turns + d * r * k[n] * q[1] - (k[m] + k[n]) * r**2 * phi[i])


@cache
def _force(row: Any) -> Any:
    """Coefficients of one row as a function of r, k_1 .. k_5."""
    q, r, k = symbols()
    return sympy.lambdify((r, *k.values()), [row.coeff(c) for c in q])


def with_rows(parameters: Mapping[str, float], rows: Mapping[int, Any]) -> Array:
    """Stiffness (12, 12) of a machine, the rows of some pulleys replaced by printed ones."""
    stiffness = matrices(parameters)[1].copy()
    for i, row in rows.items():
        constants = parameters["pulley_radius"], *section_stiffness(parameters)
        stiffness[i + 1] = -np.array(_force(row)(*constants))
    return stiffness


def rest_slope(stiffness: Array, radius: float) -> float:
    """dx/d(r phi_1) at which the free coordinates rest without friction."""
    block = stiffness[np.ix_(FREE, FREE)]
    return float(-np.linalg.solve(block, stiffness[np.ix_(FREE, MOTORS)])[0, 0] / radius)


def growth(parameters: Mapping[str, float], stiffness: Array) -> float:
    """Largest real part [1/s] of the poles, motors held, Coulomb friction left out."""
    mass, _, viscous, _ = matrices(parameters)
    inverse, n = 1 / mass[FREE], len(FREE)
    pull = -inverse[:, None] * stiffness[np.ix_(FREE, FREE)]
    poles = np.block([[np.zeros((n, n)), np.eye(n)], [pull, -np.diag(inverse * viscous[FREE])]])
    return float(np.linalg.eigvals(poles).real.max())


def reconstructions(heavy: Mapping[str, float], light: Mapping[str, float]) -> list[Signs]:
    """The signs of (8) that agree with both facts; ``heavy`` is yin2018, ``light`` light_bench."""
    found = []
    for signs in product((-1, 1), repeat=4):
        rows = {i: printed_idler(i, signs) for i in IDLERS}  # type: ignore[arg-type]
        slope = rest_slope(with_rows(heavy, rows), heavy["pulley_radius"])
        if abs(slope - REST) < NEAR and growth(light, with_rows(light, rows)) > 0:
            found.append(signs)
    return found  # type: ignore[return-value]


def wrong_terms(said: Any, right: Any) -> list[tuple[str, str, str]]:
    """Coordinate, printed and derived coefficient, where the two rows differ."""
    pairs = ((c, said.coeff(c), right.coeff(c)) for c in symbols()[0])
    return [
        (str(c), str(sympy.factor(a)), str(sympy.factor(b)))
        for c, a, b in pairs
        if sympy.expand(a - b) != 0
    ]


def idlers_with_motor(motor: int) -> list[int]:
    """Fixed idlers that turn with a motor where no belt is stretched, from V = 0 of (6)."""
    q, v, _ = lagrange()[1]
    turned = sympy.solve([sympy.diff(v, c) for c in (*q[:2], *q[4:])], [*q[:2], *q[4:]], dict=True)
    return [i for i in range(7, 11) if turned[0][q[i + 1]] == q[motor + 1]]
