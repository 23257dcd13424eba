"""Stages without belts: one axis that its motor drives directly.

The motor is fixed to the axis, so that its angle times ``pulley_radius`` is the axis' position; the
axis that is not there is a unit mass that nothing moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from corexy_fmi.topology.stage import Constants, Stage

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
