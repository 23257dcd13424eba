"""Planar stages beside Core-XY: a motor and a belt for each axis, and the H-frame's single belt.

Idlers are massless and turn freely: a section is the belt between motor and clip.  The bridge stays
square, also where an H-frame's belt would turn it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from corexy_fmi.topology.stage import Constants, Section, Stage

COORDINATES = ("x", "y", "phi1", "phi2")


def _constants(p: Mapping[str, Any], dc: Any, lengths: tuple[Any, ...]) -> Constants:
    """Carriage, bridge with the carriage on it, two rotors; belts of these lengths [m]."""
    rotor, damping = p["motor_inertia"], dc * p["motor_damping_gain"]
    return Constants(
        mass=(p["carriage_mass"], p["carriage_mass"] + p["bridge_mass"], rotor, rotor),
        viscous=(p["carriage_viscous_friction"], p["bridge_viscous_friction"], damping, damping),
        coulomb=(p["carriage_coulomb_friction"], p["bridge_coulomb_friction"], 0, 0),
        stiffness=tuple(p["belt_axial_stiffness"] / length for length in lengths),
        length=lengths,
    )


def cartesian_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """Each axis on a loop of belt over its whole span L, clipped at the middle.

    Motor to clip on one side is L / 2 of belt, around the idler 3 L / 2: side by side 3 L / 8.
    """
    spans = p["bridge_pulley_spacing"], p["motor_idler_span"]
    return _constants(p, dc, tuple(3 * span / 8 for span in spans))


def h_frame_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """One belt (Sollmann, Jouaneh, Lavender, IEEE/ASME Trans. Mechatronics 15(2), 2010).

    Clip to motor over one bridge pulley, motor to motor over both far idlers and across the bridge,
    motor to clip.
    """
    spacing, span = p["bridge_pulley_spacing"], p["motor_idler_span"]
    short = (spacing - p["clip_spacing"]) / 2 + span / 2
    return _constants(p, dc, (short, 3 * span + spacing, short))


CARTESIAN = Stage(
    "cartesian",
    COORDINATES,
    (Section("belt_x", 1, {"x": 1, "phi1": -1}), Section("belt_y", 2, {"y": 1, "phi2": -1})),
    cartesian_constants,
    topology="cartesian",
    rest=((1.0, 0.0), (0.0, 1.0)),
)
H_FRAME = Stage(
    "h_frame",
    COORDINATES,
    (
        Section("clip_left-motor1", 1, {"x": 1, "y": 1, "phi1": -1}),
        Section("motor1-motor2", 1, {"phi1": 1, "phi2": -1, "y": -2}),
        Section("motor2-clip_right", 1, {"phi2": 1, "x": -1, "y": 1}),
    ),
    h_frame_constants,
    topology="h_frame",
)
