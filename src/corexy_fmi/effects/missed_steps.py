"""A stepper motor loses (or gains) whole steps at some time.

    phi = phi_c + steps (2 pi / 200) (3 p^2 - 2 p^3),                                    [rad]
    p = clamp((t - time) / duration, 0, 1)

The rotor starts and stops slipping without a jerk.

Source: Kenjo, Sugawara, Stepping Motors and Their Microprocessor Controls, 1994.
"""

from corexy_fmi.effects.api import EVERYWHERE, MOTORS, STEPPER, TWO_PI, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp

STEP_ANGLE = TWO_PI / 200  # [rad]
SLIP = 2e-3  # [s] that the rotor takes to its new place, where nothing is told


def slip(command, rate, now, steps, time, duration):
    """Angle [rad] and rate [rad/s] of a rotor that lost its place."""
    part = clamp((now - time) / duration, 0, 1)
    lost = steps * STEP_ANGLE
    return {
        "command": command + lost * part * part * (3 - 2 * part),
        "rate": rate + lost / duration * 6 * part * (1 - part),
    }


EFFECT = Effect(
    name="missed_steps",
    summary="a jump of whole steps at some time",
    locations={name: MOTORS[name] for name in ("motor1", "motor2")},
    parameters=(
        Parameter(
            "steps",
            "1",
            "full steps of 1.8 degrees, negative where lost moving forwards",
            0.0,
            -400.0,
            400.0,
            (1.0,),
            size=True,
            local=True,
            whole=True,
        ),
        Parameter(
            "time",
            "s",
            "stamp at which it happens",
            0.0,
            -1e9,
            1e9,
            (0.03,),
            over="time",
            local=True,
        ),
        Parameter(
            "duration",
            "s",
            "that the rotor takes to its new place",
            SLIP,
            5e-4,
            0.02,
            (SLIP,),
            log=True,
            default=SLIP,
        ),
    ),
    laws=(Law("command", slip),),
    equation=r"\varphi = \varphi_c + \frac{2\pi}{200}\,n\,(3 p^2 - 2 p^3),\ "
    r"p = \mathrm{clamp}((t - t_0) / T, 0, 1)",
    citation="Kenjo, Sugawara 1994, Stepping Motors and Their Microprocessor Controls",
    remedy="Raise the motor current or lower the acceleration; free what blocks the axis.",
    check="Drive back to the start: the carriage stands off its mark by whole steps, or, where the "
    "belt jumped, by teeth.",
    looks_like="from one moment on, everything is off by a constant",
    state="time",
    drives=(STEPPER,),
    fidelities=EVERYWHERE,
)
