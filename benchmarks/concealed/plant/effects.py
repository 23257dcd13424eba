"""The catalogue: each effect's locations, size and its bounds, shape, and kernel slots.

To add an effect: its slots in layout.py, its law in the kernel (or sensor), one entry here.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass


def same(size):
    return size


@dataclass(frozen=True)
class Effect:
    """One catalogue entry.

    The size is what is scaled to reach a wanted evidence; zero size is the paper's model.
    `value` turns it into the parameter `size_name`; `shape` draws the other parameters and
    `form` the details that the catalogue leaves open; `slots` gives the kernel's numbers.
    `grid` holds the shapes, and `step` the small size, of the linearised signatures.
    """

    name: str
    locations: tuple
    size_name: str
    bounds: tuple  # smallest and largest physical size
    slots: Callable
    step: float
    value: Callable = same
    shape: Callable = lambda rng: {}
    form: Callable = lambda rng, drive: {}
    grid: tuple = ({},)
    drives: tuple = ("stepper", "dc")
    signed: bool = False
    on_stage: bool = False  # acts as a force on x or y
    group: int = 1  # so many shapes of the grid span one signature (2: two quadratures)
    dc_only: tuple = ()  # locations where imposed angles leave it without effect
    tied: tuple = ()  # parameters that a rival of the same kind elsewhere shares
    own: Callable | None = None  # parameters of one recording: from the run and the others
    spread: Callable | None = None  # all parameters, where several follow from the size

    def parameters(self, size, shape):
        if self.spread:
            return self.spread(size, shape)
        return {self.size_name: float(self.value(size)), **shape}

    def places(self, drive):
        """Locations that a drive allows."""
        if drive not in self.drives:
            return ()
        return tuple(p for p in self.locations if drive == "dc" or p not in self.dc_only)


def stribeck(where, p, form):
    extra = p["static_ratio"] - 1.0
    levels = {f"stribeck_{axis}": extra for axis in where}
    return levels | {"stribeck_speed": p["speed"], "stribeck_form": form.get("law", 0.0)}


def backlash(where, p, form):
    gaps = {"motor1": ("gap1",), "motor2": ("gap2",), "motors": ("gap1", "gap2")}[where]
    return dict.fromkeys(gaps, p["gap"]) | {f"gap_{k}": v for k, v in form.items()}


def backlash_form(rng, drive):
    """Play operator (angles imposed only), or a pulley loose on its shaft that rubs a little."""
    if drive == "stepper" and rng.random() < 0.5:
        return {"form": 1.0}
    return {"form": 0.0, "hold": float(rng.choice([0.0, 5e-4, 1e-3]))}


def eccentricity(where, p, form):
    which = {"motor1": (1,), "motor2": (2,), "motors": (1, 2)}.get(where) or (int(where[6:]),)
    out = {"runout": 1.0}
    for i in which:
        out |= {f"runout_size{i}": p["amplitude"], f"runout_phase{i}": p["phase"]}
    return out


def tool(where, p, form):
    rate = 2.0 * math.pi * p["frequency"]
    return {
        "tool_mass": p["mass"],
        "tool_stiffness": p["mass"] * rate**2,
        "tool_damping": 2.0 * p["damping_ratio"] * p["mass"] * rate,
    }


def between(rng, low, high):
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


MOTORS = ("motor1", "motor2", "motors")
QUADRATURES = ({"phase": 0.0}, {"phase": math.pi / 2})
CATALOGUE = (
    Effect(
        "stribeck_friction", ("x", "y", "xy"), "static_ratio", (0.02, 2.5), stribeck, 0.03,
        value=lambda s: 1.0 + s, on_stage=True,
        shape=lambda rng: {"speed": between(rng, 0.003, 0.03)},
        form=lambda rng, drive: {"law": float(rng.integers(0, 3))},
        grid=tuple({"speed": s} for s in (0.002, 0.005, 0.012, 0.03)),
    ),
    Effect(
        "constant_force", ("x", "y"), "force", (2e-3, 3.0),
        lambda where, p, form: {f"force_{where}": p["force"]}, 0.01, signed=True, on_stage=True,
    ),
    Effect(
        "backlash", MOTORS, "gap", (2e-4, 0.06), backlash, 1e-3, form=backlash_form,
    ),
    Effect(
        "belt_mismatch", ("belts",), "ratio", (1e-3, 0.6),
        lambda where, p, form: {"mismatch": p["ratio"]}, 5e-3, signed=True, on_stage=True,
    ),
    Effect(
        "belt_stiffness_vs_position", ("belts",), "strength", (5e-3, 1.0),
        lambda where, p, form: {"real_lengths": p["strength"], "real_form": form.get("law", 0.0)},
        0.02, form=lambda rng, drive: {"law": float(rng.integers(0, 2))}, on_stage=True,
    ),
    Effect(
        "pulley_eccentricity", (*MOTORS, *(f"pulley{i}" for i in range(3, 11))), "amplitude",
        (5e-7, 2e-4), eccentricity, 2e-6, group=2, grid=QUADRATURES,
        shape=lambda rng: {"phase": float(rng.uniform(-math.pi, math.pi))},
    ),
    Effect(
        "stepper_compliance", ("motors",), "holding_torque", (1 / 3.0, 1 / 0.03),
        lambda where, p, form: {
            "holding_torque": p["holding_torque"], "magnetic_damping": p["damping"]
        },
        0.5, value=lambda s: 1.0 / s, drives=("stepper",),
        shape=lambda rng: {"damping": between(rng, 3e-4, 3e-3)}, grid=({"damping": 1e-3},),
    ),
    Effect(
        "sensor_delay", ("sensor",), "delay", (1e-5, 0.05),
        lambda where, p, form: {"delay": p["delay"]}, 2e-4,
    ),
    Effect(
        "axis_skew", ("sensor",), "angle", (1e-6, 0.02),
        lambda where, p, form: {"skew": p["angle"]}, 1e-4, signed=True,
    ),
    Effect(
        "tool_mode", ("tool",), "mass", (2e-3, 0.2), tool, 2e-3, on_stage=True,
        shape=lambda rng: {
            "frequency": between(rng, 12.0, 90.0), "damping_ratio": between(rng, 0.01, 0.1)
        },
        grid=tuple({"frequency": f, "damping_ratio": 0.03} for f in (12.0, 20.0, 33.0, 55.0, 90.0)),
    ),
)  # fmt: skip
BY_NAME = {e.name: e for e in CATALOGUE}
