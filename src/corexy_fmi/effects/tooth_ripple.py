"""An error of belt travel at each tooth of a motor's pulley.

    u = r phi + a (w(teeth phi + phase) - w(phase)),   w(t) = sin t + p sin 2 t + q cos 2 t  [m]

A tooth's mesh is no pure sine; p and q are its overtone's sine and cosine.  It is zero at an angle
of zero, where a machine's coordinates begin.

Source: Childs et al., Proc. IMechE D 211(3), 1997 (the meshing of timing belt teeth).
"""

from corexy_fmi.effects.api import (
    EVERYWHERE,
    MOTORS,
    PHASES,
    TWO_PI,
    Effect,
    Law,
    Parameter,
    overtones,
)
from corexy_fmi.kernel.xmath import cos, sin


def mesh(travel, gain, angle, amplitude, phase, teeth, overtone_sine, overtone_cosine):
    """Belt travel [m] of a motor's pulley and its slope [m/rad]."""
    turn = teeth * angle + phase
    p, q = overtone_sine, overtone_cosine

    def wave(angle):
        return sin(angle) + p * sin(2 * angle) + q * cos(2 * angle)

    slope = cos(turn) + 2 * p * cos(2 * turn) - 2 * q * sin(2 * turn)
    return {
        "travel": travel + amplitude * (wave(turn) - wave(phase)),
        "gain": gain + amplitude * teeth * slope,
    }


EFFECT = Effect(
    name="tooth_ripple",
    summary="an error at the tooth count",
    locations=MOTORS,
    parameters=(
        Parameter(
            "amplitude", "m", "half of the ripple, peak to peak", 0.0, 0.0, 5e-4, (2e-5,), size=True
        ),
        Parameter(
            "phase",
            "rad",
            "of the ripple at a motor angle of zero",
            0.0,
            -TWO_PI / 2,
            TWO_PI / 2,
            PHASES,
            periodic=TWO_PI,
        ),
        Parameter(
            "teeth",
            "1",
            "of the pulley",
            16.0,
            6.0,
            120.0,
            (16.0, *map(float, range(10, 16)), *map(float, range(17, 41)), 48.0, 60.0),
            log=True,
        ),
        *overtones("twice the tooth's phase"),
    ),
    laws=(Law("transmission", mesh),),
    equation=r"u = r\,\varphi + a (w(z\,\varphi + \varphi_0) - w(\varphi_0)),\ "
    r"w(\theta) = \sin\theta + p \sin 2\theta + q \cos 2\theta",
    citation="Childs et al. 1997, Proc. IMechE D 211(3), The meshing of timing belt teeth",
    remedy="Match belt and pulley profile, replace a worn pulley, set the pretension as specified.",
    check="Move slowly along a ruler under a microscope: the error repeats with each tooth.",
    looks_like="a fine ripple that repeats with each tooth of one motor's pulley",
    state="motor_angle",
    fidelities=EVERYWHERE,
)
