"""The belts creep: a held elongation loses a share of its tension (standard linear solid).

    T = k (e - ratio (z_1 + z_2) / 2),   time_constant exp(+-spread) dz/dt = e - z       [N]

Quick loads meet the stiffness k, slow ones the relaxed k (1 - ratio).  A polymer creeps at more
than one pace: halves of it sooner and later by the same factor (spread > 0), else all at one.

Source: Lakes, Viscoelastic Materials, Cambridge University Press, 2009.
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp


def start(elongation):
    """The belts begin relaxed."""
    return {"crept": elongation, "crept_late": elongation}


def relax(
    tension, section_stiffness, elongation, step, crept, crept_late, ratio, time_constant, spread
):
    """Tension [N] of a section after a share of it has crept away."""
    apart = exp(spread)
    soon, late = (1 - exp(-step / t) for t in (time_constant / apart, time_constant * apart))
    now = crept + soon * (elongation - crept)
    then = crept_late + late * (elongation - crept_late)
    pull = ratio * section_stiffness * ((now + then) / 2)
    return {"tension": tension - pull, "crept": now, "crept_late": then}


EFFECT = Effect(
    name="belt_relaxation",
    summary="viscoelastic creep of the belts (standard linear solid)",
    locations=BELTS,
    parameters=(
        Parameter(
            "ratio",
            "1",
            "share of the stiffness that creeps away",
            0.0,
            0.0,
            0.95,
            (0.3,),
            size=True,
        ),
        Parameter(
            "time_constant",
            "s",
            "of the creep at a held elongation",
            0.1,
            2e-3,
            1e3,
            (0.01, 0.05, 0.2, 1.0),
            log=True,
        ),
        Parameter(
            "spread",
            "1",
            "of the logarithms of its times, to either side; 0: one time",
            0.0,
            0.0,
            2.0,
            (0.0, 1.0),
            default=0.0,
        ),
    ),
    laws=(Law("start_section", start), Law("tension", relax)),
    equation=r"T = k\,(e - \tfrac{\rho}{2}\,(z_1 + z_2)),"
    r"\qquad \tau\,e^{\mp s}\,\dot z_{1,2} = e - z_{1,2}",
    citation="Lakes 2009, Viscoelastic Materials",
    remedy="Take belts with glass or steel cord; let a new belt run in, then tighten it anew.",
    check="Hold a weight on the carriage for a minute: it goes on sinking.",
    looks_like="after a load changes, the stage creeps on for a while",
    state="load",
    coordinate="belts",
    memory=("crept", "crept_late"),
    claims={"odd": True},
)
