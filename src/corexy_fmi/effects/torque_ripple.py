"""Commutation ripple: the torque of a dc motor depends on its angle.

    tau = (K_1 V - K_2 omega) + (K_1 V - share K_2 omega) ratio sin(order phi + phase)   [N m]

The share of back-EMF is 1 where the ripple follows the current, as with a driver of voltage, and 0
where it follows the command, as with a driver of current.

Source: Jahns, Soong, IEEE Trans. Industrial Electronics 43(2), 1996, doi:10.1109/41.491356.
"""

from corexy_fmi.effects.api import DC, PHASES, TWO_PI, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import sin


def ripple(rotor_torque, angle, speed, damping_gain, ratio, order, phase, back_emf):
    """Torque [N m] of the rotor."""
    current = rotor_torque - back_emf * damping_gain * speed
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
        share(
            "back_emf",
            "share of back-EMF in the torque that the ripple follows",
            starts=(0.5,),
            default=1.0,
        ),
    ),
    laws=(Law("torque", ripple),),
    equation=r"\tau = K_1 V - K_2 \omega"
    r" + (K_1 V - s K_2 \omega)\,\rho \sin(z\,\varphi + \varphi_0)",
    citation="Jahns, Soong 1996, doi:10.1109/41.491356",
    remedy="Take a motor with more commutator segments, or feed the ripple forward by the angle.",
    check="Turn the motor slowly at a constant voltage: its speed pulses with the angle.",
    looks_like="a ripple with the motor's angle that grows with the torque",
    state="motor_angle",
    coordinate="motors",
    drives=(DC,),
)
