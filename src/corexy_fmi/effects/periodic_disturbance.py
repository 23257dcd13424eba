"""A force at a fixed frequency in time: a fan, a pump, a loose spindle.

    F = amplitude sin(2 pi frequency t + phase),  a force on an axis or a torque on a rotor

A stepper's rotor follows its command exactly unless `stepper_compliance` frees it.

Source: Bodson, Douglas, Automatica 33(12), 1997 (sinusoidal disturbances of unknown frequency).
"""

from corexy_fmi.effects.api import PHASES, TWO_PI, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import sin


def shake(applied_force, now, amplitude, frequency, phase):
    """Force [N] along an axis."""
    return {"applied_force": applied_force + amplitude * sin(TWO_PI * frequency * now + phase)}


def twist(rotor_torque, now, amplitude, frequency, phase):
    """Torque [N m] on a rotor."""
    return {"rotor_torque": rotor_torque + amplitude * sin(TWO_PI * frequency * now + phase)}


EFFECT = Effect(
    name="periodic_disturbance",
    summary="a force at a fixed frequency in time (a fan, a pump)",
    locations={"x": (0,), "y": (1,), "motor1": (0,), "motor2": (1,)},
    parameters=(
        Parameter(
            "amplitude",
            "N",
            "half of the force or torque, peak to peak",
            0.0,
            0.0,
            50.0,
            (0.1,),
            size=True,
            units={"motor1": "N m", "motor2": "N m"},
        ),
        Parameter(
            "frequency",
            "Hz",
            "in time, whatever the motion",
            10.0,
            0.05,
            1000.0,
            (10.0, 50.0),
            log=True,
            over="frequency",
        ),
        Parameter(
            "phase",
            "rad",
            "at time zero",
            0.0,
            -TWO_PI / 2,
            TWO_PI / 2,
            PHASES,
            periodic=TWO_PI,
            local=True,
        ),
    ),
    laws=(
        Law("guide", shake, locations=("x", "y")),
        Law("torque", twist, locations=("motor1", "motor2")),
    ),
    equation=r"F = a \sin(2\pi f\,t + \varphi_0)",
    citation="Bodson, Douglas 1997, Automatica 33(12)",
    remedy="Find what runs at that frequency; balance it, mount it softly or take it away.",
    check="Record at rest with the fan or pump on and off: the tone comes and goes with it.",
    looks_like="a tone of constant frequency, also while nothing moves",
    state="time",
)
