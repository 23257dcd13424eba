"""The belts creep: a held elongation loses a share of its tension (standard linear solid).

    T = k (e - ratio z),   time_constant dz/dt = e - z                                   [N]

Quick loads meet the stiffness k, slow ones the relaxed k (1 - ratio).

Source: Lakes, Viscoelastic Materials, Cambridge University Press, 2009.
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp


def start(elongation):
    """The belts begin relaxed."""
    return {"crept": elongation}


def relax(tension, section_stiffness, elongation, step, crept, ratio, time_constant):
    """Tension [N] of a section after a share of it has crept away."""
    share = 1 - exp(-step / time_constant)
    now = crept + share * (elongation - crept)
    return {"tension": tension - ratio * section_stiffness * now, "crept": now}


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
    ),
    laws=(Law("start_section", start), Law("tension", relax)),
    equation=r"T = k\,(e - \rho\,z),\qquad \tau\,\dot z = e - z",
    citation="Lakes 2009, Viscoelastic Materials",
    remedy="Take belts with glass or steel cord; let a new belt run in, then tighten it anew.",
    check="Hold a weight on the carriage for a minute: it goes on sinking.",
    looks_like="after a load changes, the stage creeps on for a while",
    state="load",
    coordinate="belts",
    memory=("crept",),
    claims={"odd": True},
)
