"""What one variable of the FMU is, and the inputs, outputs and choices that every FMU has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from corexy_fmi.kernel.call import OUTPUTS
from corexy_fmi.kernel.layout import LAW_KINDS
from corexy_fmi.topology import STAGES

ENUMERATIONS = {
    "Drive": {"stepper": "inputs phi1, phi2", "dc": "inputs V1, V2"},
    "Fidelity": {
        "full": "12 degrees of freedom: carriage, bridge and every pulley",
        "reduced": "4 degrees of freedom: carriage, bridge and both motors",
        "kinematic": "eq. (1): no mass, no friction, no belt",
        "condensed": "as reduced, idlers shared out by their static weights; stepper only",
        "single_axis": "no Core-XY: one axis that motor 1 drives directly; dc only",
        "two_mass": "no Core-XY: cart x driven directly by motor 1, cart y on a spring; dc only",
        "cartesian": "no Core-XY: motor 1 and a belt for x, motor 2 and another for y",
        "h_frame": "no Core-XY: one belt around both motors",
    },
    "InputInterpolation": {
        "hold": "stands still during a step and jumps where it is set again",
        "ramp": "goes from where the last step ended to the angle that is set, until the step ends",
    },
    "FreeFormArgument": {
        name if acts == "force" else f"{acts}_{name}": f"{acts} over {name}"
        for acts, name in LAW_KINDS
    },
}


@dataclass(frozen=True)
class Variable:
    """One variable of the FMU.

    ``kind``: Real, Integer or the name of an enumeration; ``role``: time, input, output, choice or
    parameter, with ``place`` in the array of that role; ``start`` is None where it is calculated;
    values from ``lower`` to ``upper``, and ``neutral``, may be set; ``unit`` as in machine files.
    """

    name: str
    description: str
    role: str
    place: int
    kind: str = "Real"
    unit: str | None = None
    start: float | None = None
    lower: float | None = None
    upper: float | None = None
    neutral: float | None = None
    nominal: float | None = None

    @property
    def causality(self) -> str:
        """As FMI names it."""
        return {"time": "independent", "choice": "parameter"}.get(self.role, self.role)


# name, unit, meaning
INPUTS = (
    ("phi1", "rad", "commanded angle of motor 1; dc: read once, where the run starts"),
    ("phi2", "rad", "commanded angle of motor 2; dc: read once, where the run starts"),
    ("V1", "V", "voltage of motor 1, held during a step; stepper: not read"),
    ("V2", "V", "voltage of motor 2, held during a step; stepper: not read"),
    ("phi1_rate", "rad/s", "rate of phi1 during the step, where no input derivative is given"),
    ("phi2_rate", "rad/s", "rate of phi2 during the step, where no input derivative is given"),
)
# name, its name in the kernel, unit, meaning, nominal
SHOWN = (
    ("x", "x", "m", "position x as the sensor reports it", 0.1),
    ("y", "y", "m", "position y as the sensor reports it", 0.1),
    ("x_true", "x_true", "m", "position x of the carriage", 0.1),
    ("y_true", "y_true", "m", "position y of the bridge", 0.1),
    ("vx", "vx", "m/s", "velocity along x", 0.1),
    ("vy", "vy", "m/s", "velocity along y", 0.1),
    ("ax", "ax", "m/s^2", "acceleration along x as the sensor reports it", 1.0),
    ("ay", "ay", "m/s^2", "acceleration along y as the sensor reports it", 1.0),
    ("phi1_meas", "phi1", "rad", "angle of the rotor of motor 1", 10.0),
    ("phi2_meas", "phi2", "rad", "angle of the rotor of motor 2", 10.0),
    ("omega1", "omega1", "rad/s", "speed of the rotor of motor 1", 10.0),
    ("omega2", "omega2", "rad/s", "speed of the rotor of motor 2", 10.0),
    ("torque1", "torque1", "N m", "torque on the rotor of motor 1 where it is free, else 0", 0.1),
    ("torque2", "torque2", "N m", "torque on the rotor of motor 2 where it is free, else 0", 0.1),
)
AT_REST = ("vx", "vy", "ax", "ay", "omega1", "omega2", "torque1", "torque2")  # 0 at the start


def input_variables() -> Iterator[Variable]:
    """Angles, voltages and rates."""
    for place, (name, unit, meaning) in enumerate(INPUTS):
        yield Variable(name, meaning, "input", place, unit=unit, start=0.0, nominal=10.0)


def output_variables() -> Iterator[Variable]:
    """The motion, the motors, and one tension for each belt section of the largest stage."""
    for name, kernel, unit, meaning, nominal in SHOWN:
        place = OUTPUTS.index(kernel)
        yield Variable(name, meaning, "output", place, unit=unit, nominal=nominal)
    full, reduced = STAGES["full"].sections, STAGES["reduced"].sections
    for i, section in enumerate(full):
        also = f"reduced: {reduced[i].name}" if i < len(reduced) else "reduced: 0"
        meaning = f"tension of belt {section.belt}, section {section.name}; {also}"
        name = f"tension{i + 1}"
        yield Variable(name, meaning, "output", OUTPUTS.index(name), unit="N", nominal=1.0)


def choice_variables() -> Iterator[Variable]:
    """Drive, fidelity and input interpolation, which count from 1."""
    told = (
        ("drive", "what turns the motors"),
        ("fidelity", "how much of the stage is modelled"),
        (
            "inputInterpolation",
            "phi1, phi2 in a step without input derivatives; ramp: rates not read",
        ),
    )
    for place, (name, meaning) in enumerate(told):
        kind = name[0].upper() + name[1:]
        yield Variable(name, meaning, "choice", place, kind, None, 1, 1, len(ENUMERATIONS[kind]))
