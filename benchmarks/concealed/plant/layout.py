"""Where each number of a simulated machine lies in the solver's one flat array.

Parameters come first, one name is one slot; zero in an effect's slot means that the effect is
absent. Add the slots of a new effect at the end of `EFFECTS`. Behind the parameters lie derived
constants and the state. One array, because the compiler can then prove that the regions do not
overlap and vectorises the steps.
"""

NOMINAL = [
    "pulley_radius",
    "carriage_mass",
    "bridge_mass",
    "pulley_mass",
    "pulley_inertia",
    "motor_inertia",
    "belt_axial_stiffness",
    "bridge_pulley_spacing",
    "motor_idler_span",
    "clip_spacing",
    "carriage_viscous_friction",
    "bridge_viscous_friction",
    "carriage_coulomb_friction",
    "bridge_coulomb_friction",
    "pulley_viscous_friction",
    "pulley_coulomb_friction",
    "motor_torque_gain",
    "motor_damping_gain",
]
DRIVE = ["dc", "kp", "kd", "smooth_speed"]
EFFECTS = [
    "stribeck_x",
    "stribeck_y",
    "stribeck_speed",
    "stribeck_form",
    "gap1",
    "gap2",
    "gap_form",
    "gap_hold",
    "mismatch",
    "force_x",
    "force_y",
    "real_lengths",
    "real_form",
    "runout",
    "holding_torque",
    "magnetic_damping",
    "tool_mass",
    "tool_stiffness",
    "tool_damping",
    "odd_kind",
    "odd_size",
    "odd_place",
    "odd_width",
    "delay",
    "skew",
    "bow",
]
RUNOUT = [f"runout_{what}{i}" for what in ("size", "phase") for i in range(1, 11)]
SLOTS = [*NOMINAL, *DRIVE, *EFFECTS, *RUNOUT]
SLOT = {name: i for i, name in enumerate(SLOTS)}

# coordinates: x, y, phi1 .. phi10, tool x, tool y; a region is padded to 16
N_COORD, PAD = 14, 16
# modes of a coordinate: -1 / +1 slides that way, 0 sticks, FREE has no event, IMPOSED is driven
FREE, IMPOSED = 2, 3

# behind the slots: section stiffnesses k_1 .. k_4 of belt 1, then of belt 2 (k_5 = k_2)
STIFFNESS = len(SLOTS)
# what departs from the paper: belts, other forces, dry friction
BENT_BELTS, MORE_FORCES, BENT_DRY = STIFFNESS + 8, STIFFNESS + 9, STIFFNESS + 10
MEMORY, DRIVEN, SMOOTH_TURN = STIFFNESS + 11, STIFFNESS + 13, STIFFNESS + 17
# regions of one value per coordinate
_first = (STIFFNESS + 20) // PAD * PAD + PAD
(
    LEVEL,
    VISCOUS,
    MOBILITY,
    MODE,
    DRY,
    FREEDOM,
    PUSH,
    Q,
    V,
    F,
    A,
    Q1,
    V1,
    F1,
    A1,
    QS,
    VA,
    VB,
    VC,
    AA,
    AB,
    AC,
) = (_first + PAD * i for i in range(22))
LENGTH = AC + PAD
