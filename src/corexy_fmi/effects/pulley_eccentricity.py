"""Once-per-revolution error of a pulley that does not run true.

    motor pulley:  u = r phi + a (sin(phi + phase) - sin phase)                          [m]
    idler:         its rim shifts by the same; each neighbouring section grows by half

It is zero at an angle of zero, where a machine's coordinates begin.

Source: Norton, Design of Machinery, 2011 (run-out of a pulley); CONTRACT 5 for the idlers.
"""

import math

from corexy_fmi.effects.api import EVERYWHERE, MOTORS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import cos, sin

MOTOR_PULLEYS, IDLERS = (0, 1), tuple(range(2, 10))


def travel_error(travel, gain, angle, amplitude, phase):
    """Belt travel [m] of a motor pulley and its slope [m/rad]."""
    return {
        "travel": travel + amplitude * (sin(angle + phase) - sin(phase)),
        "gain": gain + amplitude * cos(angle + phase),
    }


def rim(runout, runout_slope, angle, amplitude, phase):
    """Shift [m] of an idler's rim and its slope [m/rad]."""
    return {
        "runout": runout + amplitude * (sin(angle + phase) - sin(phase)),
        "runout_slope": runout_slope + amplitude * cos(angle + phase),
    }


EFFECT = Effect(
    name="pulley_eccentricity",
    summary="once-per-revolution error of a pulley",
    locations=MOTORS | {f"pulley{i + 1}": (i,) for i in IDLERS},
    parameters=(
        Parameter(
            "amplitude",
            "m",
            "half of the run-out, peak to peak",
            0.0,
            0.0,
            1e-3,
            (3e-5,),
            size=True,
        ),
        Parameter(
            "phase",
            "rad",
            "angle of the error at rotor angle zero",
            0.0,
            -math.pi,
            math.pi,
            (0.0, 2 * math.pi / 3, -2 * math.pi / 3),
            periodic=2 * math.pi,
        ),
    ),
    laws=(Law("transmission", travel_error, MOTOR_PULLEYS), Law("runout", rim, IDLERS)),
    equation=r"u = r\,\varphi + a (\sin(\varphi + \varphi_0) - \sin\varphi_0)",
    citation="Norton 2011, Design of Machinery; run-out of a pulley",
    remedy="Replace the pulley or seat it true on its shaft.",
    check="Put a dial gauge on the pulley's rim and turn it once.",
    looks_like="an error that repeats with each turn of one pulley",
    state="motor_angle",
    fidelities=EVERYWHERE,
)
