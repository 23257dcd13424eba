"""The rotor hangs on its magnetic spring instead of following the command exactly.

    J phi'' = -T_h sin(50 (phi - phi_c)) - D (phi' - phi_c') + belt torque - friction    [N m]

Source: Kenjo, Sugawara, Stepping Motors and Their Microprocessor Controls, 1994 (50 teeth).
"""

from corexy_fmi.effects.api import ROTOR_TEETH, STEPPER, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import maximum, sin


def field(rotor_torque, rotor_damping, angle, command, command_rate, holding_torque, damping):
    """Torque [N m] of the field on the rotor, and its damping [N m s/rad] at rest."""
    spring = holding_torque * sin(ROTOR_TEETH * (angle - command))
    return {
        "rotor_torque": rotor_torque - spring + damping * command_rate,
        "rotor_damping": rotor_damping + damping,
    }


def pole(holding_torque, damping, rotor_inertia):
    """Square [1/s^2] of the rotor's natural frequency on its field, or of its damping rate.

    Damping is stepped implicitly and may be three times faster than the step resolves.
    """
    return maximum(ROTOR_TEETH * holding_torque / rotor_inertia, (damping / rotor_inertia / 4) ** 2)


EFFECT = Effect(
    name="stepper_compliance",
    summary="rotor on its magnetic spring instead of exact angles",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter(
            "holding_torque",
            "N m",
            "peak torque of the field; 0 switches the effect off (rigid)",
            0.0,
            0.005,
            5.0,
            (0.02, 0.04, 0.06, 0.09, 0.13, 0.2, 0.35, 0.6),
            size=True,
            scaling=-1,
            log=True,
        ),
        Parameter(
            "damping",
            "N m s/rad",
            "damping of the rotor against its field",
            0.0,
            0.0,
            0.05,
            (1e-4, 2e-3),
            default=0.0,
        ),
    ),
    laws=(Law("motor", field),),
    equation=(
        r"\tau = -T_h \sin\left(50\,(\varphi - \varphi_c)\right)"
        r" - D\,(\dot\varphi - \dot\varphi_c)"
    ),
    citation="Kenjo, Sugawara 1994, Stepping Motors and Their Microprocessor Controls",
    remedy="Raise the motor current, take a motor with more holding torque, or accelerate slower.",
    check="With the motors energised, turn a pulley by hand: it springs back by degrees.",
    looks_like="extra lag under load and a ring after each start, as if the belts were softer",
    state="load",
    coordinate="motors",
    drives=(STEPPER,),
    frees_rotor=True,
    pole=pole,
)
