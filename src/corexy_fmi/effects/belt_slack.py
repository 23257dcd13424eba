"""A belt section cannot push: its tension stops at zero.

    T + T_0 = max(T_0 + k e, 0),   T_0: pretension                                       [N]

Source: Pott, Cable-Driven Parallel Robots, Springer, 2018 (a cable is a unilateral spring).
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import maximum, select


def pull(tension, pretension):
    """Tension [N] above the pretension."""
    return {"tension": select(pretension > 0, maximum(tension, -pretension), tension)}


EFFECT = Effect(
    name="belt_slack",
    summary="a belt section cannot push: its tension stops at zero",
    locations=BELTS,
    parameters=(
        Parameter(
            "pretension",
            "N",
            "of both belts at rest; 0 switches the effect off (never slack)",
            0.0,
            1e-3,
            1e4,
            (0.3, 0.5, 0.8, 1.3, 2.0, 3.2, 5.0, 8.0, 13.0, 20.0, 32.0, 50.0),
            size=True,
            log=True,
            scaling=-1,
            over="threshold",
        ),
    ),
    laws=(Law("tension", pull),),
    equation=r"T_0 + T = \max(T_0 + k\,e,\ 0)",
    citation="Pott 2018, Cable-Driven Parallel Robots",
    remedy="Tighten both belts until no section goes slack at the highest acceleration.",
    check="Pluck each free span while the machine accelerates or is pushed: one has no tone.",
    looks_like="the stage is softer than its belts as soon as the load is high enough",
    state="load",
    coordinate="belts",
    fidelities=("full",),
    claims={"odd": False},
)
