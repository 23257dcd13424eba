"""Breakaway friction above Coulomb's that falls with speed.

    f(v) = f_C (1 + (static_ratio - 1) [(1 - p) exp(-(v / speed)^2) + p exp(-|v| / speed)])   [N]

The exponent differs between lubricants and surfaces, from 1 (p = 1) to 2 (p = 0) and beyond.

Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994,
doi:10.1016/0005-1098(94)90209-7.
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import absolute, exp


def friction(bound, velocity, static_ratio, speed, pointed):
    """Coulomb bound [N] at a sliding velocity [m/s]."""
    share = absolute(velocity) / speed
    faded = (1 - pointed) * exp(-(share**2)) + pointed * exp(-share)
    return {"bound": bound * (1 + (static_ratio - 1) * faded)}


EFFECT = Effect(
    name="stribeck_friction",
    summary="breakaway friction above Coulomb's, falling with speed",
    locations=AXES,
    parameters=(
        Parameter(
            "static_ratio",
            "1",
            "breakaway over Coulomb friction",
            1.0,
            1.0,
            8.0,
            (1.8, 4.0),
            size=True,
        ),
        Parameter(
            "speed",
            "m/s",
            "speed at which the excess has faded",
            0.01,
            5e-4,
            0.3,
            (0.004, 0.012, 0.035),
            log=True,
        ),
        share(
            "pointed",
            "0: the peak is round (exponent 2), 1: it is pointed (exponent 1)",
            starts=(0.0,),
        ),
    ),
    laws=(Law("guide", friction),),
    equation=(
        r"f(v) = f_C \left(1 + (s - 1) \left[(1 - p)\, e^{-(v/v_s)^2}"
        r" + p\, e^{-|v|/v_s}\right]\right)"
    ),
    citation="Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7",
    remedy="Clean and lubricate the guide, or change its grease or preload.",
    check="Pull the free axis with a spring balance: starting takes more force than moving on.",
    looks_like="a peak of missing force just after each reversal or start, gone at speed",
    state="velocity_reversal",
    claims={"odd": True, "dissipative": True},
)
