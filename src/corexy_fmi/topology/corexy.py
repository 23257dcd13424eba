"""Core-XY stages of Yin et al. 2018 (IEEE RCAR): 12-DoF, 4-DoF and kinematic; 4-DoF condensed.

Belt 1 runs over pulleys 3, 1, 9, 8, 6 and belt 2 over 4, 2, 10, 7, 5.  The rows are the brackets of
eq. (6) with the sign that makes tension positive; each belt's elongations sum to zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from corexy_fmi.topology.stage import Constants, Section, Stage

PULLEYS = tuple(f"phi{i}" for i in range(1, 11))

# name, belt, row, slope of the length over (x, y), end of the bridge
FULL_SECTIONS = (
    Section("clip_left-3", 1, {"phi3": 1, "x": 1}, (1, 0)),
    Section("3-motor1", 1, {"phi3": -1, "phi1": -1, "y": 1}, (0, 1), -1),
    Section("motor1-9", 1, {"phi9": -1, "phi1": 1}),
    Section("9-8", 1, {"phi9": 1, "phi8": -1}),
    Section("8-6", 1, {"phi8": 1, "phi6": -1, "y": -1}, (0, -1), 1),
    Section("6-clip_right", 1, {"phi6": 1, "x": -1}, (-1, 0)),
    Section("clip_right-4", 2, {"phi4": -1, "x": -1}, (-1, 0)),
    Section("4-motor2", 2, {"phi4": 1, "phi2": 1, "y": 1}, (0, 1), 1),
    Section("motor2-10", 2, {"phi10": 1, "phi2": -1}),
    Section("10-7", 2, {"phi10": -1, "phi7": 1}),
    Section("7-5", 2, {"phi7": -1, "phi5": 1, "y": -1}, (0, -1), -1),
    Section("5-clip_left", 2, {"phi5": -1, "x": 1}, (1, 0)),
)
REDUCED_SECTIONS = (
    Section("belt1", 1, {"x": 1, "y": 1, "phi1": -1}),
    Section("belt2", 2, {"x": 1, "y": -1, "phi2": -1}),
)


def _lengths(p: Mapping[str, Any]) -> tuple[Any, ...]:
    """Section lengths l_1 .. l_5 [m] at the centre (PHYSICS 3)."""
    spacing, span = p["bridge_pulley_spacing"], p["motor_idler_span"]
    return (spacing - p["clip_spacing"]) / 2, span / 2, span, spacing, span / 2


def _moving_mass(p: Mapping[str, Any]) -> Any:
    """M of eq. (4) [kg]: bridge, carriage and four bridge pulleys."""
    return p["bridge_mass"] + p["carriage_mass"] + 4 * p["pulley_mass"]


def full_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """Constants of the 12-DoF model, eqs (4), (6), (7); with dc, K_2 damps the motors."""
    lengths = _lengths(p)
    belt = tuple(lengths[i] for i in (0, 1, 2, 3, 4, 0))
    ring, friction = p["pulley_viscous_friction"], p["pulley_coulomb_friction"]
    motor = ring + dc * p["motor_damping_gain"]
    inertias = [p["motor_inertia"]] * 2 + [p["pulley_inertia"]] * 8
    carriage, bridge = p["carriage_viscous_friction"], p["bridge_viscous_friction"]
    coulomb = (p["carriage_coulomb_friction"], p["bridge_coulomb_friction"])
    return Constants(
        mass=(p["carriage_mass"], _moving_mass(p), *inertias),
        viscous=(carriage, bridge, motor, motor, *[ring] * 8),
        coulomb=(*coulomb, *[friction] * 10),
        stiffness=tuple(p["belt_axial_stiffness"] / length for length in belt * 2),
        length=belt * 2,
    )


def equivalent_stiffness(p: Mapping[str, Any]) -> Any:
    """k_e of eq. (15) [N/m]: the idlers of one belt condensed statically."""
    k1, k2, k3, k4, k5 = (p["belt_axial_stiffness"] / length for length in _lengths(p))
    return k1 * k2 / (k1 + k2) + 1 / (1 / k1 + 1 / k3 + 1 / k4 + 1 / k5)


def reduced_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """Constants of the 4-DoF model, eqs (11)-(16) with (12), (14) corrected (PHYSICS 2)."""
    radius, equivalent = p["pulley_radius"], equivalent_stiffness(p)
    ring, friction = p["pulley_viscous_friction"], p["pulley_coulomb_friction"]
    inertia, motor = p["pulley_inertia"], 3 * ring + dc * p["motor_damping_gain"]
    carriage = p["carriage_viscous_friction"] + 4 * ring / radius**2
    coulomb = p["carriage_coulomb_friction"] + 4 * friction / radius
    rotor = p["motor_inertia"] + 2 * inertia
    return Constants(
        mass=(p["carriage_mass"] + 4 * inertia / radius**2, _moving_mass(p), rotor, rotor),
        viscous=(carriage, p["bridge_viscous_friction"], motor, motor),
        coulomb=(coulomb, p["bridge_coulomb_friction"], *[3 * friction] * 2),
        stiffness=(equivalent, equivalent),
        length=(p["belt_axial_stiffness"] / equivalent,) * 2,
    )


def idler_weights(p: Mapping[str, Any]) -> tuple[Any, Any]:
    """How many idlers the end-effector carries in x and in y, of the 8 and 4 that turn.

    An idler at rest between its belt's ends follows each by the share of the belt's length beyond
    it: over 3 the sections l_1, l_2, over 9, 8, 6 the sections l_3, l_4, l_5, l_1.  The rest of its
    friction and inertia burdens the motors.  The paper's 4-DoF model has 4 and 0 instead.
    """
    l1, l2, l3, l4, l5 = _lengths(p)
    whole = l3 + l4 + l5 + l1
    fixed = (l3 + l3 + l4) / whole
    return 2 * (l2 / (l1 + l2) + (l3 + l4 + l5) / whole + fixed), 2 * fixed


def condensed_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """Constants of the 4-DoF model with idlers condensed statically (PHYSICS 2), stepper only.

    Each idler's inertia and friction, at the rate that (1) gives it, burden x and y by its static
    weight; the stiffness is (15) as in the reduced model.
    """
    in_x, in_y = idler_weights(p)
    radius, at_motor = p["pulley_radius"], 3 - in_y / 2
    inertia, ring = p["pulley_inertia"] / radius**2, p["pulley_viscous_friction"] / radius**2
    dry = p["pulley_coulomb_friction"] / radius
    rotor = p["motor_inertia"] + (at_motor - 1) * p["pulley_inertia"]
    carriage, bridge = p["carriage_viscous_friction"], p["bridge_viscous_friction"]
    coulomb = p["carriage_coulomb_friction"], p["bridge_coulomb_friction"]
    base = reduced_constants(p, dc)
    return Constants(
        mass=(p["carriage_mass"] + in_x * inertia, _moving_mass(p) + in_y * inertia, rotor, rotor),
        viscous=(
            carriage + in_x * ring,
            bridge + in_y * ring,
            *[at_motor * p["pulley_viscous_friction"] + dc * p["motor_damping_gain"]] * 2,
        ),
        coulomb=(
            coulomb[0] + in_x * dry,
            coulomb[1] + in_y * dry,
            *[at_motor * p["pulley_coulomb_friction"]] * 2,
        ),
        stiffness=base.stiffness,
        length=base.length,
    )


def kinematic_constants(p: Mapping[str, Any], dc: Any) -> Constants:
    """Eq. (1) has no dynamics; unit masses keep the table whole."""
    return Constants(mass=(1,) * 4, viscous=(0,) * 4, coulomb=(0,) * 4, stiffness=(), length=())


FULL = Stage("full", ("x", "y", *PULLEYS), FULL_SECTIONS, full_constants)
REDUCED = Stage("reduced", ("x", "y", *PULLEYS[:2]), REDUCED_SECTIONS, reduced_constants)
KINEMATIC = Stage("kinematic", ("x", "y", *PULLEYS[:2]), (), kinematic_constants)
CONDENSED = Stage("condensed", REDUCED.coordinates, REDUCED_SECTIONS, condensed_constants)
