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
_MORE = """
    bristle_x bristle_y bristle_form spot_x spot_y spot_center spot_width spot_form
    load_x load_y load_form drag_x drag_y drag_form
    warm_x warm_y warm_time warm_form warm_onset
    pretension slack_form damping_time damping_form hardening hardening_form
    creep_ratio creep_time creep_form tooth1 tooth2 tooth_phase teeth tooth_form
    detent detent_phase detent_order microstep1 microstep2 microstep_phase microstep_form
    lost1 lost2 lost_time lost_form winding_time winding_form deadband deadband_form
    supply supply_form ripple ripple_order ripple_phase ripple_form
    rack_stiffness rack_inertia rack_damping frame_mass frame_stiffness frame_damping
    cable_x cable_y cable_center cable_form
    beat_x beat_y beat_motor1 beat_motor2 beat_frequency beat_phase beat_duty
    rotation scale_x scale_y lag lag_form drift
"""
MORE = _MORE.split()
# of these, what makes a law of laws.py act, what makes it act while all rests, what bends a belt
_IN_TIME = """
    warm_x warm_y winding_time beat_x beat_y beat_motor1 beat_motor2 damping_time creep_ratio
    frame_mass rack_stiffness
"""
_BESIDE = """
    bristle_x bristle_y spot_x spot_y load_x load_y drag_x drag_y detent ripple cable_x cable_y
"""
_BENDING = "pretension hardening tooth1 tooth2 rack_stiffness"
RUNOUT = [f"runout_{what}{i}" for what in ("size", "phase") for i in range(1, 11)]
SLOTS = [*NOMINAL, *DRIVE, *EFFECTS, *RUNOUT, *MORE]
SLOT = {name: i for i, name in enumerate(SLOTS)}
IN_TIME, BESIDE, BENDING = (
    tuple(SLOT[n] for n in names.split()) for names in (_IN_TIME, _BESIDE, _BENDING)
)

# coordinates: x, y, phi1 .. phi10, tool x, tool y; then frame x, frame y, yaw of the bridge, and
# (in V alone) the motors' torques behind their windings; only the first N_COORD have dry friction
N_COORD, FRAME, YAW, WOUND, PAD = 14, 14, 16, 17, 20
# modes of a coordinate: -1 / +1 slides that way, 0 sticks, FREE has no event, IMPOSED is driven
FREE, IMPOSED = 2, 3

# behind the slots: section stiffnesses k_1 .. k_4 of belt 1, then of belt 2 (k_5 = k_2)
STIFFNESS = len(SLOTS)
# what departs from the paper: belts, other forces, dry friction
BENT_BELTS, MORE_FORCES, BENT_DRY = STIFFNESS + 8, STIFFNESS + 9, STIFFNESS + 10
MEMORY, DRIVEN, SMOOTH_TURN = STIFFNESS + 11, STIFFNESS + 13, STIFFNESS + 17
# more flags; a row's time, when memories were last brought up, dry friction beyond level (x, y)
BEYOND, RESTLESS, NOW, SEEN, EXTRA = (STIFFNESS + 18 + i for i in range(5))
# memories: bristles of x and y (place, four shares), three relaxing arms of 12 coordinates
BRISTLES, ARMS = EXTRA + 2, EXTRA + 12
# regions of one value per coordinate
_first = (ARMS + 36) // PAD * PAD + PAD
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
    QE,
    FE,
) = (_first + PAD * i for i in range(24))
LENGTH = FE + PAD

# time in which the arm of Zener's damping relaxes [s]: short of what belts swing at, else it creeps
ZENER = 4e-4
