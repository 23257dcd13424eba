"""Stages whose motor drives its axis directly: one axis, or two carts joined by a spring.

The motor is fixed to x, so that its angle times ``pulley_radius`` is the position; the axis that is
not there is a unit mass that nothing moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from corexy_fmi.topology.stage import Constants, Section, Stage

MOTORS = ("phi1", "phi2")


def single_axis_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """M x'' + F_v x' + F_c sgn x' = g V / r (Janot, Gautier, Brunot 2019, EMPS)."""
    return Constants(
        mass=(p["moving_mass"], 1, 1, 1),
        viscous=(p["viscous_friction"], 0, 0, 0),
        coulomb=(p["coulomb_friction"], 0, 0, 0),
        stiffness=(),
        length=(),
        damping_time=0,
    )


SINGLE_AXIS = Stage(
    "single_axis",
    ("x", "y", *MOTORS),
    (),
    single_axis_constants,
    topology="single_axis",
    rest=((1.0, 0.0), (0.0, 0.0)),
    direct=(True, False),
)


def two_mass_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """x is the driven cart, y the sprung one: k (x - y) + c (x' - y') between them."""
    return Constants(
        mass=(p["mass_1"], p["mass_2"], 1, 1),
        viscous=(p["viscous_friction_1"], p["viscous_friction_2"], 0, 0),
        coulomb=(p["coulomb_friction_1"], p["coulomb_friction_2"], 0, 0),
        stiffness=(p["spring_stiffness"],),
        length=(1,),
        damping_time=p["spring_damping"] / p["spring_stiffness"],
    )


TWO_MASS = Stage(
    "two_mass",
    SINGLE_AXIS.coordinates,
    (Section("spring", 1, {"y": 1, "x": -1}),),
    two_mass_constants,
    topology="two_mass",
    rest=((1.0, 0.0), (1.0, 0.0)),
    direct=(True, False),
)
