"""Breakaway friction above Coulomb's that falls with speed.

    f(v) = f_C (1 + (static_ratio - 1) exp(-(v / speed)^2))                              [N]

Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994,
doi:10.1016/0005-1098(94)90209-7.
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp


def friction(bound, velocity, static_ratio, speed):
    """Coulomb bound [N] at a sliding velocity [m/s]."""
    excess = (static_ratio - 1) * exp(-((velocity / speed) ** 2))
    return {"bound": bound * (1 + excess)}


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
    ),
    laws=(Law("guide", friction),),
    equation=r"f(v) = f_C \left(1 + (s - 1)\, e^{-(v/v_s)^2}\right)",
    citation="Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7",
    remedy="Clean and lubricate the guide, or change its grease or preload.",
    check="Pull the free axis with a spring balance: starting takes more force than moving on.",
    looks_like="a peak of missing force just after each reversal or start, gone at speed",
    state="velocity_reversal",
    claims={"odd": True, "dissipative": True},
)
