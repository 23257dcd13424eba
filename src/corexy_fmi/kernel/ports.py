"""The ports: where an effect's law meets the stage, and which variables it reads and writes there.

One micro-step runs the ports in the order of this table (`fmu_src/native/stage.c`, `reference.py`).
A port is evaluated for the places of an effect's location: motors (0, 1), axes (x 0, y 1),
pulleys (0..9 for pulley 1..10), belt sections (0..11) or the sensor (0).  Each variable maps to the
array of the stage's state that holds it and an index, where ``i`` is the place and ``1 - i`` the
other axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

# [s], read by every law: time in the middle of the step, since the run began, and the step
COMMON = {"now": "now", "elapsed": "elapsed", "step": "step"}


@dataclass(frozen=True)
class Port:
    """A port: variable name -> (array, index expression); those in ``writes`` may be returned."""

    name: str
    variables: Mapping[str, tuple[str, str]]
    writes: frozenset[str]
    meaning: str


def _port(name: str, meaning: str, writes: str, **variables: str) -> Port:
    """Each variable as ``array`` or ``array:offset`` (the place plus an offset)."""
    table = {}
    for key, where in variables.items():
        array, _, offset = where.partition(":")
        table[key] = (array, offset or "i")
    return Port(name, table, frozenset(writes.split()), meaning)


_ALL = (
    _port(
        "rotor",
        "once, before all else: the angle [rad] at which a rotor rests; the axes rest at its angle",
        "angle",
        angle="q:i + 2",
        command="command",
    ),
    _port(
        "start",
        "once at a motor, when a run starts: what a memory begins with",
        "",
        travel="travel",
        angle="q:i + 2",
        command="command",
        radius="radius:0",
    ),
    _port("start_axis", "the same on an axis", "", position="q"),
    _port("start_sensor", "the same at the sensor", "", x="reported:0", y="reported:1"),
    _port("start_section", "the same at a belt section", "", elongation="elongation"),
    _port(
        "command",
        "the commanded motor angle [rad] and rate [rad/s], before the motor",
        "command rate",
        command="command",
        rate="command_rate",
    ),
    _port(
        "transmission",
        "belt travel [m] of a motor pulley and its slope [m/rad] over the angle",
        "travel gain",
        travel="travel",
        gain="gain",
        angle="q:i + 2",
        radius="radius:0",
    ),
    _port(
        "runout",
        "shift [m] of an idler's rim, which lengthens both neighbouring sections by half of itself,"
        " and its slope [m/rad] over the idler's angle",
        "runout runout_slope",
        runout="runout",
        runout_slope="runout_slope",
        angle="q:i + 2",
    ),
    _port(
        "shape",
        "elongation [m] of a section; yaw_arm is -1, 0 or 1: how a yaw of the bridge times half of"
        " its spacing [m] lengthens it",
        "elongation",
        elongation="elongation",
        side="side",
        yaw_arm="yaw_arm",
        spacing="spacing:0",
    ),
    _port(
        "belt",
        "stiffness law of a section: stiffness [N/m], its slope over the length [N/m^2], damping"
        " time [s]",
        "section_stiffness slope damping_time",
        section_stiffness="stiffness",
        slope="slope",
        damping_time="belt_time",
        elongation="elongation",
        length="length",
        centre_length="length0",
        belt="belt_sign",
    ),
    _port(
        "contact",
        "offset [m] of the belt travel against the motor's rotor; pull [N] is the net belt force"
        " at zero offset, pull_stiffness [N/m] its slope",
        "offset",
        offset="offset",
        pull="pull",
        pull_stiffness="pull_stiffness",
        travel="travel",
        radius="radius:0",
    ),
    _port(
        "tension",
        "belt tension [N] of a section above its pretension",
        "tension",
        tension="tension",
        section_stiffness="stiffness",
        elongation="elongation",
        rate="rate",
    ),
    _port(
        "motor",
        "torque [N m] and damping [N m s/rad] of a rotor by its field (stepper), and the voltage"
        " [V] that it gets (dc)",
        "rotor_torque rotor_damping applied_voltage",
        rotor_torque="torque",
        rotor_damping="rotor_damping",
        applied_voltage="applied",
        angle="q:i + 2",
        speed="v:i + 2",
        command="command",
        command_rate="command_rate",
        back_emf="back_emf:0",
    ),
    _port(
        "torque",
        "torque [N m] of a rotor by its field or, with a dc drive, by its voltage; damping_gain"
        " [N m s/rad] times the speed is what back-EMF takes off it",
        "rotor_torque",
        rotor_torque="torque",
        angle="q:i + 2",
        speed="v:i + 2",
        damping_gain="damping_gain:0",
    ),
    _port(
        "guide",
        "Coulomb bound [N], viscous damping [N s/m] and force [N] along an axis; velocity [m/s] in"
        " the middle of the step, exactly 0 while it sticks; across [N] is the belts' force on the"
        " other axis",
        "bound damping applied_force moving_mass",
        bound="bound",
        damping="damping",
        applied_force="force",
        position="q",
        velocity="middle_v",
        moving_mass="moving",
        across="across",
    ),
    _port(
        "stick",
        "the same after all laws of the guide: what takes the place of set-valued friction",
        "bound applied_force",
        bound="bound",
        applied_force="force",
        position="q",
    ),
    _port(
        "structure",
        "once after the kick of an axis: what its velocity [m/s] before and after, and the belts'"
        " torque on the bridge [N m], make of an effect's own coordinate",
        "",
        velocity="v",
        velocity_before="before",
        axis_mass="mass",
        yaw_torque="yaw_torque:0",
        spacing="spacing:0",
    ),
    _port(
        "output",
        "position [m], velocity [m/s] and acceleration [m/s^2] that are reported of an axis",
        "position velocity acceleration",
        position="reported",
        velocity="reported_velocity",
        acceleration="reported_acceleration",
        across_position="reported:1 - i",
        across_velocity="reported_velocity:1 - i",
        across_acceleration="reported_acceleration:1 - i",
    ),
    _port(
        "filter",
        "once after each micro-step: what a sensor's memory makes of reported positions [m] and"
        " accelerations [m/s^2]",
        "",
        x="reported:0",
        y="reported:1",
        ax="reported_acceleration:0",
        ay="reported_acceleration:1",
    ),
    _port(
        "sensor",
        "what the sensor makes of both axes: positions [m], accelerations [m/s^2]",
        "x y ax ay",
        x="reported:0",
        y="reported:1",
        ax="reported_acceleration:0",
        ay="reported_acceleration:1",
    ),
    _port("sampling", "how late [s] the sensor's samples are", "lateness", lateness="lateness:0"),
    _port(
        "clock",
        "when [s] since the run began a sample was taken that is stamped so; by whoever replays a"
        " recording, not by an FMU",
        "stamp",
        stamp="stamp:0",
    ),
)
PORTS = {port.name: port for port in _ALL}
OBSERVERS = ("output", "sensor", "sampling", "clock")  # whenever somebody looks: may not remember
HOST = ("clock",)  # run on the finished response, see clock.py
