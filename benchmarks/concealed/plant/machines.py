"""Base machines, their free parameters, and the machine file an engine is given."""

import numpy as np

from .kernel import STEEPEST, derive
from .layout import LENGTH, NOMINAL, SLOT, STIFFNESS, ZENER

YIN2018 = {
    "pulley_radius": 5.0e-3,
    "carriage_mass": 0.10,
    "bridge_mass": 0.20,
    "pulley_mass": 6e-3,
    "pulley_inertia": 1.0e-7,
    "motor_inertia": 5.4e-6,
    "belt_axial_stiffness": 880.0,
    "bridge_pulley_spacing": 0.24,
    "motor_idler_span": 0.30,
    "clip_spacing": 0.06,
    "carriage_viscous_friction": 60.0,
    "bridge_viscous_friction": 60.0,
    "carriage_coulomb_friction": 0.2,
    "bridge_coulomb_friction": 0.2,
    "pulley_viscous_friction": 8.0e-4,
    "pulley_coulomb_friction": 2e-4,
    "motor_torque_gain": 0.095,
    "motor_damping_gain": 3.1e-3,
}
LIGHT_BENCH = YIN2018 | {
    "bridge_mass": 0.25,
    "carriage_viscous_friction": 2.0,
    "bridge_viscous_friction": 2.0,
    "carriage_coulomb_friction": 0.3,
    "bridge_coulomb_friction": 0.3,
    "pulley_viscous_friction": 2e-5,
    "pulley_coulomb_friction": 5e-4,
}
GT2_PRINTER = YIN2018 | {
    "belt_axial_stiffness": 19.4e3,
    "pulley_radius": 6.366e-3,
    "bridge_pulley_spacing": 0.35,
    "motor_idler_span": 0.40,
    "clip_spacing": 0.05,
    "carriage_mass": 0.35,
    "bridge_mass": 0.45,
    "pulley_mass": 8e-3,
    "pulley_inertia": 3e-7,
    "carriage_viscous_friction": 15.0,
    "bridge_viscous_friction": 15.0,
    "carriage_coulomb_friction": 0.5,
    "bridge_coulomb_friction": 0.5,
    "pulley_viscous_friction": 5e-6,
    "pulley_coulomb_friction": 2e-4,
}
BASES = {"yin2018": YIN2018, "light_bench": LIGHT_BENCH, "gt2_printer": GT2_PRINTER}
KNOWN_EXACTLY = {"pulley_radius", "bridge_pulley_spacing", "motor_idler_span", "clip_spacing"}
DC_ONLY = {"motor_inertia", "motor_torque_gain", "motor_damping_gain"}
GAINS = {"kp": 20.0, "kd": 0.1}
LEAST_STEPS = 4  # per ms


def base(name, drive):
    """Parameters of a base machine; a dc motor brings its own rotor."""
    values = dict(BASES[name])
    if drive == "dc":
        values["motor_inertia"] = 2.1e-5
    return values


def free_names(drive):
    """Nominal parameters that can be retuned: those that act on the motion at all."""
    skip = KNOWN_EXACTLY if drive == "dc" else KNOWN_EXACTLY | DC_ONLY
    return [n for n in NOMINAL if n not in skip]


def free_groups(drive):
    """Free names in groups; of the bridge and its pulleys only the mass of all counts."""
    together = {"bridge_mass": ("bridge_mass", "pulley_mass")}
    return tuple(together.get(n, (n,)) for n in free_names(drive) if n != "pulley_mass")


def draw_truth(rng, values):
    """True parameters, 10 - 20 % (one sigma, drawn for each) off the base machine."""
    truth = dict(values)
    for name in free_names("dc"):
        spread = rng.uniform(0.10, 0.20)
        truth[name] = values[name] * float(np.exp(np.clip(rng.normal(0.0, spread), -0.45, 0.45)))
    return truth


def pack(values, drive, effect_slots=None):
    """The kernel's parameter array."""
    p = np.zeros(LENGTH)
    for name, value in values.items():
        p[SLOT[name]] = value
    if drive == "dc":
        p[SLOT["dc"]] = 1.0
        for name, value in GAINS.items():
            p[SLOT[name]] = value
    for name, value in (effect_slots or {}).items():
        p[SLOT[name]] = value
    derive(p)
    return p


RISING = 8.0  # so many times shorter are steps while a current rises: a rotor breaks loose within


def added_rates(w, near):
    """Fastest rates that effects bring [1/s]."""
    inertia, r = w[SLOT["pulley_inertia"]], w[SLOT["pulley_radius"]]
    slow = 2.0 if w[SLOT["damping_form"]] == 0.0 else 0.0
    stiff = 1.0 + w[SLOT["creep_ratio"]] + w[SLOT["damping_time"]] / ZENER * (slow == 0.0)
    tied = max(w[SLOT["bristle_x"]], w[SLOT["bristle_y"]]) / w[SLOT["carriage_mass"]]
    drag = slow * near * r * r * w[SLOT["damping_time"]] + w[SLOT["pulley_viscous_friction"]]
    rates = [drag / inertia]
    rates += [np.sqrt(2.0 * near * stiff / inertia) * r, np.sqrt(tied)]
    if w[SLOT["winding_time"]] > 0.0:
        rates.append(RISING / w[SLOT["winding_time"]])
    if w[SLOT["rack_stiffness"]] > 0.0:
        half = 0.5 * w[SLOT["bridge_pulley_spacing"]]
        turning = w[SLOT["rack_stiffness"]] + 4.0 * near * half**2
        rates.append(np.sqrt(turning / w[SLOT["rack_inertia"]]))
        rates.append(w[SLOT["rack_damping"]] / w[SLOT["rack_inertia"]])
    return rates


def steps_per_ms(w):
    """RK4 steps in a row: enough to be stable for the fastest pole of this machine."""
    drag, inertia = w[SLOT["pulley_viscous_friction"]], w[SLOT["pulley_inertia"]]
    r, near = w[SLOT["pulley_radius"]], w[STIFFNESS] + w[STIFFNESS + 1]
    carriage = w[SLOT["carriage_mass"]]  # a retuned one may be light
    rates = [drag / inertia, np.sqrt(2.0 * near / inertia) * r, np.sqrt(4.0 * near / carriage)]
    rates.append(w[SLOT["carriage_viscous_friction"]] / carriage)
    motor, back = w[SLOT["motor_inertia"]], w[SLOT["motor_damping_gain"]]
    if w[SLOT["dc"]] != 0.0:
        rates.append((drag + back) / motor)
    if w[SLOT["holding_torque"]] > 0.0:
        rates.append((drag + w[SLOT["magnetic_damping"]]) / motor)
        rates.append(np.sqrt(50.0 * w[SLOT["holding_torque"]] / motor))
    rates += added_rates(w, near)
    smooth = w[SLOT["smooth_speed"]]
    if smooth > 0.0:
        stage = w[SLOT["carriage_coulomb_friction"]] / carriage
        rates += [stage / smooth, STEEPEST]
    return max(LEAST_STEPS, int(np.ceil(max(rates) * 1e-3 / 2.2)))


def machine_toml(values, drive):
    """Machine file: values only, so each has the format's default uncertainty."""
    lines = ["[machine]", 'name = "stage"', 'topology = "corexy"', f'drive = "{drive}"']
    lines += ['fidelity = "full"', ""]
    if drive == "dc":
        lines += ["[controller]", *(f"{k} = {v!r}" for k, v in GAINS.items()), ""]
    lines += ["[parameters]", *(f"{n} = {float(values[n])!r}" for n in NOMINAL)]
    lines += ["belt_damping_time = 0.0"]
    return "\n".join(lines) + "\n"
