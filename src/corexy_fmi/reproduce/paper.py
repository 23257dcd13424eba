"""What the paper states and what must come out: speeds, parameter sets, claims, reference numbers.

The paper's own numbers (Table I, the points in its figures) did not reach us.  The reference values
below are those of the project's specification, computed for parameter set P1 with another solver.
"""

from __future__ import annotations

from corexy_fmi.machine import Machine, load_machine, models_folder

SPEEDS = (0.020, 0.039, 0.079)  # [m/s]
SETS = {"P0": "light_bench", "P1": "yin2018", "P2": "gt2_printer"}
STEP_ANGLE = 1.8  # [degree] of a full step
MODELS = {"ideal": "kinematic", "4-DoF": "reduced", "condensed": "condensed", "full": "full"}

SINGLE = {  # [mm] one corner, the other axis never moved before; P1 at the three speeds
    ("full", "x->y"): (0.309, 0.572, 1.127),
    ("full", "y->x"): (0.135, 0.243, 0.471),
    ("4-DoF", "x->y"): (0.267, 0.492, 0.966),
    ("4-DoF", "y->x"): (0.023, 0.044, 0.088),
}
LATER = {  # [mm] a rectangle run from the second corner on
    ("full", "x->y"): (0.309, 0.573, 1.128),
    ("full", "y->x"): (0.1425, 0.2509, 0.480),
    ("4-DoF", "y->x"): (0.056, 0.0735, 0.117),
}
EXPONENTS = {"mass": -0.06, "stiffness": -1.06, "friction": 1.15}  # P1, x->y
SETTLING = {"x": 0.070, "y": 0.042}  # [s] P1
FLOOR = {"x->y": 0.057, "y->x": 0.043}  # [mm] P1, what Coulomb friction leaves of (f)

CLAIMS = {
    "a": "straight runs are clean, corners are rounded",
    "b": "the error from x to y exceeds that from y to x",
    "c": "the error is linear in speed",
    "d": "the full model lies above the 4-DoF one, most from y to x and at high speed",
    "e": "the error hardly depends on the masses, is proportional to friction and inversely "
    "proportional to stiffness",
    "f": "no error beyond 5 % once a pulse takes longer than the settling time",
}
OTHER = "another machine than the paper's"
CHOSEN = "P1 was chosen so that the paper's claims hold: that they do here is no evidence for them"


def bundled(name: str) -> Machine:
    """A machine of `SETS`, whatever lies in the working folder."""
    return load_machine(str(models_folder() / name / "machine.toml"))


def label(machine: Machine) -> str:
    """The line under every figure and table of a machine."""
    name = next(key for key, value in SETS.items() if value == machine.name)
    more = {"P1": CHOSEN, "P2": OTHER}.get(name, "")
    parts = [f"{name} ({machine.name})", machine.surrogate, more]
    return "; ".join(part for part in parts if part)
