"""Parameter sets for the kernel's lanes: of a machine, scaled, and drawn from physical ranges."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.layout import bundled_layout, nominal_index
from corexy_fmi.simulate import neutral_vector

Array = NDArray[np.float64]
Parameters = dict[str, float]
REFERENCE = "yin2018"
RANGES = {  # plausible ranges of the specification's section 4
    "pulley_radius": (4.85e-3, 6.47e-3),
    "belt_axial_stiffness": (400.0, 1200.0),
    "carriage_mass": (0.05, 0.3),
    "bridge_mass": (0.1, 0.5),
    "pulley_mass": (3e-3, 15e-3),
    "pulley_inertia": (0.4e-7, 5e-7),
    "carriage_viscous_friction": (0.3, 80.0),
    "bridge_viscous_friction": (0.3, 80.0),
    "carriage_coulomb_friction": (0.02, 2.0),
    "bridge_coulomb_friction": (0.02, 2.0),
    "pulley_viscous_friction": (5e-6, 2e-3),
    "pulley_coulomb_friction": (1e-5, 5e-3),
}
GROUPS = {  # what Fig. 5 scales
    "mass": ("carriage_mass", "bridge_mass", "pulley_mass", "pulley_inertia"),
    "stiffness": ("belt_axial_stiffness",),
    "friction": tuple(name for name in RANGES if name.endswith("friction")),
}
COULOMB = tuple(name for name in RANGES if name.endswith("coulomb_friction"))
ROTATING = {"pulley_inertia": 2, "pulley_viscous_friction": 2, "pulley_coulomb_friction": 1}


def scaled(parameters: Mapping[str, float], group: str, factor: float) -> Parameters:
    """Parameters with one group of `GROUPS` times a factor."""
    return {n: v * (factor if n in GROUPS[group] else 1.0) for n, v in parameters.items()}


def without_coulomb(parameters: Mapping[str, float]) -> Parameters:
    """Parameters without dry friction."""
    return {n: 0.0 if n in COULOMB else v for n, v in parameters.items()}


def at_radius(parameters: Mapping[str, float], radius: float) -> Parameters:
    """The same stage on pulleys of another radius [m]: J / r^2, B_p / r^2 and tau_f / r kept.

    x and y then follow the belts alike, so that sets of different radii share one command.
    """
    ratio = radius / parameters["pulley_radius"]
    scale = {name: ratio**power for name, power in ROTATING.items()}
    return {n: v * scale.get(n, 1.0) for n, v in parameters.items()} | {"pulley_radius": radius}


def drawn(base: Mapping[str, float], count: int, seed: int) -> list[Parameters]:
    """Sets from `RANGES`, log-uniform and independent; lengths as in ``base``."""
    random = np.random.default_rng(seed)
    low, high = np.log(np.array(list(RANGES.values()))).T
    values = np.exp(random.uniform(low, high, (count, len(RANGES))))
    return [dict(base) | dict(zip(RANGES, row.tolist(), strict=True)) for row in values]


def vectors(sets: Iterable[Mapping[str, float]]) -> Array:
    """Parameter vectors of the kernel, (sets, layout.parameters), effects neutral."""
    layout = bundled_layout()
    rows = []
    for parameters in sets:
        row = neutral_vector(layout)
        for name, value in parameters.items():
            row[nominal_index(name)] = value
        rows.append(row)
    return np.array(rows)
