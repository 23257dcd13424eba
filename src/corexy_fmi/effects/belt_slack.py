"""A belt section cannot push: its tension stops at zero.

    T = mean of max(T_0 + k e + d, 0) - T_0 - d over 0 < d < w,   w = spread T_0         [N]

T_0 is the pretension, of the loosest strand where it differs over the belt's width: the strands of
a belt that runs askew go slack one after the other (spread > 0), else all at once (spread = 0).

Source: Pott, Cable-Driven Parallel Robots, Springer, 2018 (a cable is a unilateral spring).
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp, maximum, select


def pull(tension, pretension, spread):
    """Tension [N] above the pretension."""
    loosest, width = tension + pretension, spread * pretension
    taut = clamp(loosest + width, 0, width)
    uneven = maximum(tension, -pretension) + taut * taut / (2 * width + 1e-300) - width / 2
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
            "of both belts at rest, where they are loosest; 0 switches the effect off",
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
            "of the pretension over the belt's width, as a share of the loosest strand's",
            0.0,
            0.0,
            10.0,
            (0.0, 2.0),
            default=0.0,
        ),
    ),
    laws=(Law("tension", pull),),
    equation=r"T = \frac{1}{w} \int_0^w (\max(T_0 + k\,e + d,\ 0) - T_0 - d)\,\mathrm{d}d,\ "
    r"w = s\,T_0",
    citation="Pott 2018, Cable-Driven Parallel Robots",
    remedy="Tighten both belts until no section goes slack at the highest acceleration.",
    check="Pluck each free span while the machine accelerates or is pushed: one has no tone.",
    looks_like="the stage is softer than its belts as soon as the load is high enough",
    state="load",
    coordinate="belts",
    fidelities=("full",),
    claims={"odd": False},
)
