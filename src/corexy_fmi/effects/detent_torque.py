"""Cogging: the rotor prefers some angles even without current.

    tau = -torque sin(order phi + phase)                                                 [N m]

A stepper's rotor is then no longer exactly where it is told to be: it brings its magnetic spring
-T_h sin(50 (phi - phi_c)) - D (phi' - phi_c') with it, as in `stepper_compliance`.  A run begins
with the rotor at rest between both.

Source: Kenjo, Sugawara, Stepping Motors and Their Microprocessor Controls, 1994 (detent torque).
"""

from corexy_fmi.effects.api import (
    DC,
    PHASES,
    ROTOR_TEETH,
    STEPPER,
    TWO_PI,
    Effect,
    Law,
    Parameter,
)
from corexy_fmi.effects.stepper_compliance import field
from corexy_fmi.kernel.xmath import maximum, select, sin

SEAT_STEPS = 4  # leave 2 % of the detents' torque where the field is three times as stiff as they


def seat(angle, command, torque, phase, order, holding_torque):
    """Angle [rad] of a stepper's rotor at rest between its field and the detents (damped steps)."""
    aside, stiffest = 0.0, ROTOR_TEETH * holding_torque + order * torque
    for _ in range(SEAT_STEPS):
        pull = torque * sin(order * (command + aside) + phase)
        aside = aside - (holding_torque * sin(ROTOR_TEETH * aside) + pull) / stiffest
    return {"angle": angle + aside}


def spring(
    rotor_torque, rotor_damping, angle, command, command_rate, torque, holding_torque, damping
):
    """Torque [N m] and damping [N m s/rad] of a stepper's field."""
    held = field(rotor_torque, rotor_damping, angle, command, command_rate, holding_torque, damping)
    given = {"rotor_torque": rotor_torque, "rotor_damping": rotor_damping}
    return {name: select(torque > 0, held[name], given[name]) for name in given}


def cog(rotor_torque, angle, torque, phase, order):
    """Torque [N m] towards the nearest detent."""
    return {"rotor_torque": rotor_torque - torque * sin(order * angle + phase)}


def pole(torque, order, holding_torque, damping, rotor_inertia):
    """Square [1/s^2] of the rotor's frequency on field and detents, or of its damping rate."""
    spring = ROTOR_TEETH * holding_torque + order * torque
    return maximum(spring / rotor_inertia, (damping / rotor_inertia / 4) ** 2)


EFFECT = Effect(
    name="detent_torque",
    summary="cogging of the motors",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter(
            "torque",
            "N m",
            "half of the cogging torque, peak to peak",
            0.0,
            0.0,
            0.5,
            (0.01,),
            size=True,
        ),
        Parameter(
            "phase",
            "rad",
            "at a motor angle of zero",
            0.0,
            -TWO_PI / 2,
            TWO_PI / 2,
            PHASES,
            periodic=TWO_PI,
        ),
        Parameter(
            "order",
            "1",
            "detents a turn (a stepper with steps of 1.8 degrees has 200)",
            200.0,
            2.0,
            400.0,
            (14.0, *map(float, range(3, 14)), *map(float, range(15, 25)), 28.0, 36.0, 50.0, 200.0),
            log=True,
            default=200.0,
            drives=(DC,),
        ),
        Parameter(
            "holding_torque",
            "N m",
            "peak torque of a stepper's field",
            0.4,
            0.005,
            5.0,
            (0.05, 0.4),
            log=True,
            default=0.4,
            drives=(STEPPER,),
        ),
        Parameter(
            "damping",
            "N m s/rad",
            "of a stepper's rotor against its field",
            1e-3,
            0.0,
            0.05,
            (1e-3,),
            default=1e-3,
            drives=(STEPPER,),
        ),
    ),
    laws=(
        Law("rotor", seat, drives=(STEPPER,)),
        Law("motor", spring, drives=(STEPPER,)),
        Law("motor", cog),
    ),
    equation=r"\tau = -T_d \sin(z\,\varphi + \varphi_0)",
    citation="Kenjo, Sugawara 1994, Stepping Motors and Their Microprocessor Controls",
    remedy="Raise the motor current, or take a motor with less detent torque or skewed slots.",
    check="Turn the motor's shaft by hand without current: it clicks from place to place.",
    looks_like="a ripple that repeats with each detent, largest at low speed and light load",
    state="motor_angle",
    coordinate="motors",
    frees_rotor=True,
    pole=pole,
)
