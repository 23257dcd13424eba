"""An angle error of a stepper motor that repeats with each electrical cycle.

    phi = phi_c + a (sin(50 phi_c + phase) - sin phase)                                  [rad]

It is zero at a command of zero, where a machine's coordinates begin.

Source: Kenjo, Sugawara, Stepping Motors and Their Microprocessor Controls, 1994 (microstepping).
"""

from corexy_fmi.effects.api import (
    EVERYWHERE,
    MOTORS,
    PHASES,
    ROTOR_TEETH,
    STEPPER,
    TWO_PI,
    Effect,
    Law,
    Parameter,
)
from corexy_fmi.kernel.xmath import cos, sin


def microstep(command, rate, amplitude, phase):
    """Angle [rad] and rate [rad/s] that the motor makes of its command."""
    turn = ROTOR_TEETH * command + phase
    return {
        "command": command + amplitude * (sin(turn) - sin(phase)),
        "rate": rate * (1 + ROTOR_TEETH * amplitude * cos(turn)),
    }


EFFECT = Effect(
    name="microstep_error",
    summary="an angle error periodic in the electrical cycle",
    locations=MOTORS,
    parameters=(
        Parameter(
            "amplitude",
            "rad",
            "half of the error, peak to peak",
            0.0,
            0.0,
            0.05,
            (0.003,),
            size=True,
        ),
        Parameter(
            "phase",
            "rad",
            "of the error at a motor angle of zero",
            0.0,
            -TWO_PI / 2,
            TWO_PI / 2,
            PHASES,
            periodic=TWO_PI,
        ),
    ),
    laws=(Law("command", microstep),),
    equation=r"\varphi = \varphi_c + a (\sin(50\,\varphi_c + \varphi_0) - \sin\varphi_0)",
    citation="Kenjo, Sugawara 1994, Stepping Motors and Their Microprocessor Controls",
    remedy="Use a driver with corrected currents, tune its offsets, or take a 0.9-degree motor.",
    check="Step by single microsteps and measure each: their sizes repeat every four full steps.",
    looks_like="a fine ripple that repeats fifty times a turn of one motor",
    state="motor_angle",
    drives=(STEPPER,),
    fidelities=EVERYWHERE,
)
