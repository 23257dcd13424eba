"""Commutation ripple: the torque of a dc motor depends on its angle.

    tau = (K_1 V - K_2 omega) (1 + ratio sin(order phi + phase))                         [N m]

Source: Jahns, Soong, IEEE Trans. Industrial Electronics 43(2), 1996, doi:10.1109/41.491356.
"""

from corexy_fmi.effects.api import DC, PHASES, TWO_PI, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import sin


def ripple(rotor_torque, angle, speed, damping_gain, ratio, order, phase):
    """Torque [N m] of the rotor."""
    current = rotor_torque - damping_gain * speed
    return {"rotor_torque": rotor_torque + ratio * current * sin(order * angle + phase)}


EFFECT = Effect(
    name="torque_ripple",
    summary="commutation ripple",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter("ratio", "1", "amplitude over the torque", 0.0, 0.0, 0.9, (0.1,), size=True),
        Parameter(
            "order",
            "1",
            "ripples a turn",
            14.0,
            1.0,
            200.0,
            (14.0, *map(float, range(2, 14)), *map(float, range(15, 25)), 28.0, 32.0, 36.0),
            log=True,
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
    ),
    laws=(Law("torque", ripple),),
    equation=r"\tau = (K_1 V - K_2 \omega)\left(1 + \rho \sin(z\,\varphi + \varphi_0)\right)",
    citation="Jahns, Soong 1996, doi:10.1109/41.491356",
    remedy="Take a motor with more commutator segments, or feed the ripple forward by the angle.",
    check="Turn the motor slowly at a constant voltage: its speed pulses with the angle.",
    looks_like="a ripple with the motor's angle that grows with the torque",
    state="motor_angle",
    coordinate="motors",
    drives=(DC,),
)
