"""Effects that a user might write, as texts: each goes into a temporary folder in a test."""

LAG = '''
"""A first-order filter in the sensor."""

from corexy_fmi.effects.api import SENSOR, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp


def start(x, y):
    return {"seen_x": x, "seen_y": y}


def follow(x, y, seen_x, seen_y, step, time_constant):
    share = 1 - exp(-step / time_constant)
    return {"seen_x": seen_x + share * (x - seen_x), "seen_y": seen_y + share * (y - seen_y)}


def show(seen_x, seen_y):
    return {"x": seen_x, "y": seen_y}


EFFECT = Effect(
    name="my_lag",
    summary="a slow sensor",
    locations=SENSOR,
    parameters=(
        Parameter("time_constant", "s", "of the filter", 0.0, 1e-4, 0.1, (0.01,), size=True),
    ),
    laws=(Law("start_sensor", start), Law("filter", follow), Law("sensor", show)),
    equation=r"T x_m' = x - x_m",
    citation="none",
    remedy="take a faster sensor",
    check="look at a step",
    looks_like="late and rounded",
    state="speed",
    memory=("seen_x", "seen_y"),
    fidelities=("full", "reduced", "kinematic"),
)
'''

EVERY_PORT = '''
"""An effect that has a law at every port and a memory at most of them."""

from corexy_fmi.effects.api import MOTORS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import absolute, clamp, cos, exp, maximum, select, sin, sqrt


def start(travel, angle):
    return {"first": travel, "second": cos(angle)}


def start_axis(position):
    return {"first": position}


def start_section(elongation):
    return {"second": elongation}


def torque(rotor_torque, speed, damping_gain, size):
    return {"rotor_torque": rotor_torque * (1 + size) - size * damping_gain * speed}


def stick(bound, applied_force, position, size):
    return {"bound": bound * (1 - size), "applied_force": applied_force - size * position}


def structure(velocity, velocity_before, axis_mass, yaw_torque, spacing, second, elapsed):
    moved = axis_mass * (velocity - velocity_before) + yaw_torque * spacing
    return {"second": second + 1e-3 * moved * elapsed}


def clock(stamp, size):
    return {"stamp": stamp * (1 + size)}


def command(command, rate, first, size):
    return {"command": command + size * sin(command), "rate": rate * (1 + size), "first": rate}


def transmission(travel, gain, radius, size):
    return {"travel": travel * (1 + size), "gain": gain + radius * size}


def shape(elongation, side, yaw_arm, spacing, size):
    return {"elongation": elongation * (1 + size * side) + 1e-4 * size * yaw_arm * spacing}


def belt(section_stiffness, damping_time, length, centre_length, belt, size):
    ratio = centre_length / maximum(length, centre_length / 2)
    return {
        "section_stiffness": section_stiffness * ratio ** (size * 3),
        "damping_time": damping_time + size * 1e-4 * (2 + belt),
    }


def contact(offset, pull, pull_stiffness, size):
    return {"offset": offset + clamp(size * pull / pull_stiffness, -1e-4, 1e-4)}


def tension(tension, rate, elongation, first, step, size):
    return {"tension": tension + size * first, "first": first + step * (rate + elongation)}


def motor(rotor_torque, rotor_damping, applied_voltage, command, angle, size):
    return {
        "rotor_torque": rotor_torque - 5 * sin(angle - command),
        "rotor_damping": rotor_damping + size * 1e-2,
        "applied_voltage": select(applied_voltage > 0, applied_voltage + size, applied_voltage),
    }


def guide(bound, damping, applied_force, velocity, position, moving_mass, now, second, size):
    return {
        "bound": bound * (1 + size * exp(-absolute(velocity) / 0.01)),
        "damping": damping * (1 + size),
        "applied_force": applied_force + size * moving_mass * sin(300 * now) - size * position,
        "second": second + size * velocity * absolute(velocity),
    }


def output(position, velocity, acceleration, across_velocity, size):
    seen = position + size * velocity - size * across_velocity
    return {"position": seen, "acceleration": acceleration * (1 + size)}


def sensor(x, y, ax, ay, size):
    return {"x": x - size * y, "y": y + size * x, "ax": sqrt(ax**2 + size), "ay": ay * ax}


EFFECT = Effect(
    name="my_everything",
    summary="a law at every port",
    locations=MOTORS | {"x": (0,)},
    parameters=(Parameter("size", "1", "of all of it", 0.0, 0.0, 1.0, (0.01,), size=True),),
    laws=(
        Law("start", start),
        Law("start_axis", start_axis),
        Law("command", command),
        Law("transmission", transmission),
        Law("shape", shape),
        Law("belt", belt),
        Law("contact", contact),
        Law("tension", tension),
        Law("motor", motor),
        Law("guide", guide),
        Law("output", output),
        Law("sensor", sensor),
        Law("start_section", start_section),
        Law("torque", torque),
        Law("stick", stick),
        Law("structure", structure),
        Law("clock", clock),
    ),
    equation="x",
    citation="none",
    remedy="none",
    check="none",
    looks_like="a mess",
    state="load",
    memory=("first", "second"),
    frees_rotor=True,
)
'''

BOW = '''
"""A sensor whose x axis is bowed."""

from corexy_fmi.effects.api import SENSOR, Effect, Law, Parameter


def bend(x, y, bow):
    return {"x": x + bow * y * y}


EFFECT = Effect(
    name="my_bow",
    summary="a bowed scale",
    locations=SENSOR,
    parameters=(Parameter("bow", "1/m", "of x", 0.0, -10.0, 10.0, (0.5,), size=True),),
    laws=(Law("sensor", bend),),
    equation=r"x_m = x + b y^2",
    citation="none",
    remedy="none",
    check="none",
    looks_like="an error of x that grows with y squared",
    state="position",
    fidelities=("full", "reduced", "kinematic"),
)
'''
