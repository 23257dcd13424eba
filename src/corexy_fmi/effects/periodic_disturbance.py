"""A force at a fixed frequency in time: a fan, a pump, a loose spindle; or pulses.

    F = amplitude sin(2 pi frequency t + phase),  a force on an axis or a torque on a rotor
    F = amplitude while frac(frequency t + phase / 2 pi) < duty, else 0,         where duty > 0

Pulses are averaged over a micro-step, so that their edges lie where they are said to.

A stepper's rotor follows its command exactly unless `stepper_compliance` frees it.

Source: Bodson, Douglas, Automatica 33(12), 1997 (sinusoidal disturbances of unknown frequency).
"""

from corexy_fmi.effects.api import PHASES, TWO_PI, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import floor, maximum, minimum, select, sin


def filled(turns, duty):
    """Integral [1] of the pulses up to so many periods."""
    whole = floor(turns)
    return whole * duty + minimum(turns - whole, duty)


def wave(now, step, frequency, phase, duty):
    """Course [1] of the force in the middle of a step [s]."""
    turns, part = frequency * now + phase / TWO_PI, maximum(frequency * step, 1e-12)
    pulses = (filled(turns + part / 2, duty) - filled(turns - part / 2, duty)) / part
    return select(duty > 0, pulses, sin(TWO_PI * frequency * now + phase))


def shake(applied_force, now, step, amplitude, frequency, phase, duty):
    """Force [N] along an axis."""
    return {"applied_force": applied_force + amplitude * wave(now, step, frequency, phase, duty)}


def twist(rotor_torque, now, step, amplitude, frequency, phase, duty):
    """Torque [N m] on a rotor."""
    return {"rotor_torque": rotor_torque + amplitude * wave(now, step, frequency, phase, duty)}


EFFECT = Effect(
    name="periodic_disturbance",
    summary="a force at a fixed frequency in time (a fan, a pump)",
    locations={"x": (0,), "y": (1,), "motor1": (0,), "motor2": (1,)},
    parameters=(
        Parameter(
            "amplitude",
            "N",
            "half of the force or torque, peak to peak; all of it where it comes in pulses",
            0.0,
            0.0,
            1000.0,
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
        Parameter(
            "duty",
            "1",
            "share of a period that a pulse fills; 0: a sine",
            0.0,
            0.0,
            0.99,
            (0.0,),
            default=0.0,
            shape=True,
        ),
    ),
    laws=(
        Law("guide", shake, locations=("x", "y")),
        Law("torque", twist, locations=("motor1", "motor2")),
    ),
    equation=r"F = a \sin(2\pi f\,t + \varphi_0)\ \text{or}\ "
    r"a\,[\mathrm{frac}(f\,t + \varphi_0 / 2\pi) < d]",
    citation="Bodson, Douglas 1997, Automatica 33(12)",
    remedy="Find what runs at that frequency; balance it, mount it softly or take it away.",
    check="Record at rest with the fan or pump on and off: the tone comes and goes with it.",
    looks_like="a tone of constant frequency, also while nothing moves",
    state="time",
)
