"""A belt section cannot push: its tension stops at zero.

    T = mean of max(T_0 (1 + d) + k e, 0) - T_0 over -spread < d < spread                [N]

T_0 is the pretension, which a plucked span's tone tells.  Over the width of a belt that runs askew
it differs, and its strands go slack one after the other (spread > 0), else all at once.

Source: Pott, Cable-Driven Parallel Robots, Springer, 2018 (a cable is a unilateral spring).
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp, maximum, select


def pull(tension, pretension, spread):
    """Tension [N] above the pretension."""
    half = spread * pretension
    taut = clamp(tension + pretension + half, 0, 2 * half)  # of the tightest strand
    uneven = maximum(tension - half, -pretension) + taut * taut / (4 * half + 1e-300)
    sharp = maximum(tension, -pretension)
    return {"tension": select(pretension > 0, select(spread > 0, uneven, sharp), tension)}


EFFECT = Effect(
    name="belt_slack",
    summary="a belt section cannot push: its tension stops at zero",
    locations=BELTS,
    parameters=(
        Parameter(
            "pretension",
            "N",
            "of both belts at rest; 0 switches the effect off",
            0.0,
            1e-3,
            1e4,
            (0.3, 0.5, 0.8, 1.3, 2.0, 3.2, 5.0, 8.0, 13.0, 20.0, 32.0, 50.0),
            size=True,
            log=True,
            scaling=-1,
            over="threshold",
        ),
        Parameter(
            "spread",
            "1",
            "of the pretension over the belt's width, to either side, as a share of it",
            0.0,
            0.0,
            1.0,
            (0.0, 0.5),
            default=0.0,
        ),
    ),
    laws=(Law("tension", pull),),
    equation=r"T = \frac{1}{2 s} \int_{-s}^{s} \max(T_0\,(1 + d) + k\,e,\ 0)\,\mathrm{d}d - T_0",
    citation="Pott 2018, Cable-Driven Parallel Robots",
    remedy="Tighten both belts until no section goes slack at the highest acceleration.",
    check="Pluck each free span while the machine accelerates or is pushed: one has no tone.",
    looks_like="the stage is softer than its belts as soon as the load is high enough",
    state="load",
    coordinate="belts",
    fidelities=("full",),
    claims={"odd": False},
)
