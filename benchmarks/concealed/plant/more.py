"""The other 25 entries of the catalogue; their laws are in laws.py, bends.py and recording.py.

`form` is a detail that the catalogue leaves open: mostly which of several functional forms of
the literature acts, numbered as in the law.
"""

import math

from .effects import CATALOGUE, MOTORS, QUADRATURES, Effect, between


def on_axes(slot, size, **more):
    """Slots of a law of x and y: its size there, then slot=parameter (or the form)."""

    def slots(where, p, form):
        return {f"{slot}_{axis}": p[size] for axis in where} | others(more, p, form)

    return slots


def direct(**names):
    """Slots that hold parameters (or a number of the form) as they are."""
    return lambda where, p, form: others(names, p, form)


def others(names, p, form):
    both = {"law": 0.0, **form, **p}
    return {slot: float(both[name]) for slot, name in names.items()}


def at_motors(slot, size, **more):
    def slots(where, p, form):
        which = {"motor1": (1,), "motor2": (2,), "motors": (1, 2)}[where]
        return {f"{slot}{i}": p[size] for i in which} | others(more, p, form)

    return slots


def one_of(count):
    return lambda rng, drive: {"law": float(rng.integers(0, count))}


def inverse(size):
    return 1.0 / size


def any_phase(rng):
    return {"phase": float(rng.uniform(-math.pi, math.pi))}


def crossed(shapes):
    """Both quadratures of each shape."""
    return tuple(shape | phase for shape in shapes for phase in QUADRATURES)


def cogging(where, p, form):
    """A stepper's rotor needs its magnetic spring to be turned by a torque."""
    if p["torque"] == 0.0:
        return {}
    out = {
        "detent": p["torque"],
        "detent_phase": p["phase"],
        "detent_order": form.get("order", 200.0),
    }
    if form.get("drive", "stepper") == "stepper":
        out |= {"holding_torque": form.get("holding", 0.4), "magnetic_damping": 1e-3}
    return out


def cogging_form(rng, drive):
    """Four a tooth in a hybrid stepper; a dc motor as the catalogue's only period, or its slots."""
    if drive == "dc":
        return {"drive": drive, "order": float(rng.choice([200.0, 14.0]))}
    return {"drive": drive, "order": 200.0, "holding": between(rng, 0.25, 0.6)}


def frame(where, p, form):
    rate = 2.0 * math.pi * p["frequency"]
    return {
        "frame_mass": p["mass"],
        "frame_stiffness": p["mass"] * rate**2,
        "frame_damping": 2.0 * p["damping_ratio"] * p["mass"] * rate,
    }


def racking(where, p, form):
    """Yaw; the form is its damping ratio."""
    ratio = 2.0 * form.get("damping_ratio", 0.1)
    return {
        "rack_stiffness": p["stiffness"],
        "rack_inertia": p["inertia"],
        "rack_damping": ratio * math.sqrt(p["stiffness"] * p["inertia"]),
    }


def beat_slots(where, p, form):
    more = {"beat_frequency": p["frequency"], "beat_phase": p["phase"]}
    return {f"beat_{where}": p["amplitude"], "beat_duty": form.get("duty", 0.0)} | more


def pulses(rng, drive):
    return {"duty": float(rng.choice([0.0, 0.15, 0.3]))}


def uneven(size, shape):
    """Gain errors of the two axes from one size and the direction between them."""
    parts = (math.cos(shape["toward"]), math.sin(shape["toward"]))
    return {f"scale_{axis}": 1.0 + size * part for axis, part in zip("xy", parts, strict=True)}


AXES, BOTH = ("x", "y"), ("x", "y", "xy")
MORE = (
    # Dahl, LuGre, generalised Maxwell slip
    Effect(
        "presliding_hysteresis", BOTH, "stiffness", (1e-6, 3e-3),
        on_axes("bristle", "stiffness", bristle_form="law"), 2e-5,
        value=inverse, form=one_of(3), grid=({}, {"stiffness": 4e3}),
    ),
    # Gaussian, raised cosine
    Effect(
        "friction_vs_position", AXES, "extra", (5e-3, 3.0),
        on_axes("spot", "extra", spot_center="center", spot_width="width", spot_form="law"), 0.02,
        shape=lambda rng: {"center": 0.0, "width": between(rng, 3e-3, 2e-2)}, form=one_of(2),
        grid=tuple({"center": c, "width": 0.015} for c in (-0.03, 0.0, 0.03)),
        on_stage=True,
    ),
    # with the belts' force on the guide, along and across, or across alone
    Effect(
        "load_friction", BOTH, "coefficient", (1e-3, 0.5),
        on_axes("load", "coefficient", load_form="law"), 5e-3, form=one_of(2),
    ),
    # quadratic from the start, or linear at low speed
    Effect(
        "quadratic_drag", BOTH, "coefficient", (0.05, 500.0),
        on_axes("drag", "coefficient", drag_form="law"), 1.0, form=one_of(2), on_stage=True,
    ),
    # exponential in Coulomb's friction, or of two time constants and in viscous friction too
    Effect(
        "friction_warmup", BOTH, "extra_ratio", (5e-3, 3.0),
        on_axes("warm", "extra_ratio", warm_time="time_constant", warm_form="law"), 0.02,
        shape=lambda rng: {"time_constant": between(rng, 1.0, 8.0)}, form=one_of(2),
        grid=({"time_constant": 1.5}, {"time_constant": 5.0}), tied=("time_constant",),
        on_stage=True, own=lambda run, p: {"onset": run.onset},
    ),
    # sharp, soft
    Effect(
        "belt_slack", ("belts",), "pretension", (0.02, 20.0),
        direct(pretension="pretension", slack_form="law"), 0.5, value=inverse, form=one_of(2),
        grid=tuple({"pretension": p} for p in (0.5, 2.0)),
    ),
    # Kelvin-Voigt, Zener
    Effect(
        "belt_damping", ("belts",), "time", (2e-6, 5e-3),
        direct(damping_time="time", damping_form="law"), 5e-5, form=one_of(2),
    ),
    # stiffness linear or exponential in strain
    Effect(
        "belt_hardening", ("belts",), "coefficient", (0.2, 150.0),
        direct(hardening="coefficient", hardening_form="law"), 2.0, form=one_of(2),
    ),
    # one relaxation time, or two about it
    Effect(
        "belt_relaxation", ("belts",), "ratio", (1e-3, 0.8),
        direct(creep_ratio="ratio", creep_time="time_constant", creep_form="law"), 0.01,
        shape=lambda rng: {"time_constant": between(rng, 0.03, 1.5)}, form=one_of(2),
        grid=tuple({"time_constant": t} for t in (0.08, 0.7)),
    ),
    # a sine, or one with an overtone
    Effect(
        "tooth_ripple", MOTORS, "amplitude", (2e-7, 1e-4),
        at_motors("tooth", "amplitude", tooth_phase="phase", teeth="teeth", tooth_form="law"), 1e-6,
        shape=lambda rng: any_phase(rng) | {"teeth": int(rng.integers(15, 25))}, form=one_of(2),
        grid=crossed(({"teeth": 16}, {"teeth": 20})), group=2, tied=("teeth",),
    ),
    Effect(
        "detent_torque", ("motors",), "torque", (2e-4, 0.1), cogging, 2e-3,
        shape=any_phase, form=cogging_form, grid=QUADRATURES, group=2,
    ),
    # the electrical cycle, or its fourth harmonic beside it
    Effect(
        "microstep_error", MOTORS, "amplitude", (1e-5, 0.02),
        at_motors("microstep", "amplitude", microstep_phase="phase", microstep_form="law"), 2e-4,
        shape=any_phase, form=one_of(2), grid=QUADRATURES, group=2, drives=("stepper",),
    ),
    # lost in 2 ms, or in a swing of 8 ms
    Effect(
        "missed_steps", ("motor1", "motor2"), "steps", (1.0, 4.0),
        lambda where, p, form: {
            f"lost{where[5]}": p["steps"], "lost_form": form.get("law", 0.0)
        },
        1.0, value=round, signed=True, form=one_of(2), drives=("stepper",),
        own=lambda run, p: {"steps": p["steps"] * run.times_lost, "time": run.lost_at},
    ),
    # with the back emf inside the winding's loop, or a lag of the current alone
    Effect(
        "winding_lag", ("motors",), "time_constant", (2e-5, 2e-3),
        direct(winding_time="time_constant", winding_form="law"), 2e-4,
        form=one_of(2), drives=("dc",),
    ),
    # a dead zone, or a threshold
    Effect(
        "driver_deadband", ("motors",), "voltage", (2e-3, 3.0),
        direct(deadband="voltage", deadband_form="law"), 0.02, form=one_of(2), drives=("dc",),
    ),
    # sharp, with a knee
    Effect(
        "supply_saturation", ("motors",), "voltage", (0.03, 4.0),
        direct(supply="voltage", supply_form="law"), 0.3, value=inverse, form=one_of(2),
        drives=("dc",), grid=tuple({"voltage": v} for v in (0.7, 2.0)),
    ),
    # of the driving torque, or of what is left of it over the back emf
    Effect(
        "torque_ripple", ("motors",), "ratio", (1e-3, 0.9),
        direct(ripple="ratio", ripple_order="order", ripple_phase="phase", ripple_form="law"), 0.02,
        shape=lambda rng: any_phase(rng) | {"order": int(rng.choice([5, 7, 10, 14, 24]))},
        form=one_of(2), drives=("dc",), grid=crossed(({"order": 7},)), group=2,
    ),
    Effect(
        "racking", ("bridge",), "stiffness", (5e-6, 0.05), racking, 5e-4, value=inverse,
        shape=lambda rng: {"inertia": between(rng, 5e-4, 5e-3)}, grid=({"inertia": 1.5e-3},),
        form=lambda rng, drive: {"damping_ratio": between(rng, 0.02, 0.3)},
    ),
    Effect(
        "frame_mode", ("frame",), "mass", (1e-3, 5.0), frame, 0.1, value=inverse,
        shape=lambda rng: {
            "frequency": between(rng, 5.0, 60.0), "damping_ratio": between(rng, 0.01, 0.1)
        },
        grid=tuple({"frequency": f, "damping_ratio": 0.03} for f in (7.0, 18.0, 45.0)),
    ),
    # a straight line, or one that stiffens
    Effect(
        "cable_drag", AXES, "stiffness", (0.02, 60.0),
        on_axes("cable", "stiffness", cable_center="center", cable_form="law"), 0.5,
        shape=lambda rng: {"center": float(rng.uniform(-0.05, 0.05))}, form=one_of(2),
        # one that ends at the frame pulls nearly evenly
        grid=tuple({"center": c} for c in (-0.3, 0.0, 0.3)), on_stage=True,
    ),
    # a sine, or rounded pulses; imposed angles leave a torque on a motor without effect
    Effect(
        "periodic_disturbance", ("x", "y", "motor1", "motor2"), "amplitude", (1e-6, 2.0),
        beat_slots, 1e-3, dc_only=("motor1", "motor2"), form=pulses, on_stage=True,
        shape=lambda rng: {"frequency": between(rng, 1.5, 40.0), "phase": 0.0},
        grid=crossed(({"frequency": 5.0},)), group=2, tied=("frequency",),
        own=lambda run, p: {"phase": run.phase},
    ),
    Effect(
        "sensor_rotation", ("sensor",), "angle", (1e-6, 0.02), direct(rotation="angle"), 1e-4,
        signed=True,
    ),
    Effect(
        "sensor_scale", ("sensor",), "scale", (1e-6, 0.05),
        lambda where, p, form: {f"scale_{a}": p[f"scale_{a}"] - 1.0 for a in "xy"}, 1e-4,
        shape=lambda rng: {"toward": float(rng.uniform(-math.pi, math.pi))}, spread=uneven,
        grid=({"toward": 0.0}, {"toward": math.pi / 2}), group=2,
    ),
    # in continuous time, or as firmware filters (backward Euler at 1 kHz)
    Effect(
        "sensor_lag", ("sensor",), "time_constant", (1e-5, 0.05),
        direct(lag="time_constant", lag_form="law"), 2e-4, form=one_of(2),
    ),
    Effect("clock_drift", ("sensor",), "ratio", (1e-6, 0.01), direct(drift="ratio"), 1e-5,
           signed=True),
)  # fmt: skip
FULL = (*CATALOGUE, *MORE)
