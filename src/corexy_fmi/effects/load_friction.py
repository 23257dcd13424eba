"""Friction of a guide that grows with the load that the belts put on it.

    f = f_C + coefficient hypot(F_across, along F_along)                                 [N]

F_across is the belts' force along the other axis; F_along, along the guide itself, loads its
bearings by a moment where the belts pull beside them (along > 0).

Source: Bittencourt, Gunnarsson, J. Dynamic Systems, Measurement, and Control 134(5), 2012,
doi:10.1115/1.4006589 (friction that grows with the load).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import sqrt


def friction(bound, across, applied_force, coefficient, along):
    """Coulomb bound [N] under a load."""
    moment = along * applied_force
    return {"bound": bound + coefficient * sqrt(across * across + moment * moment)}


EFFECT = Effect(
    name="load_friction",
    summary="friction that grows with the belts' load on the guide",
    locations=AXES,
    parameters=(
        Parameter("coefficient", "1", "friction over load", 0.0, 0.0, 1.0, (0.1,), size=True),
        share("along", "load by the force along, over that by the force across", upper=10.0),
    ),
    laws=(Law("guide", friction),),
    equation=r"f = f_C + \mu\,\sqrt{F_\perp^2 + (a F_\parallel)^2}",
    citation="Bittencourt, Gunnarsson 2012, doi:10.1115/1.4006589",
    remedy="Take bearings made for side loads, lubricate them, or bring the belts nearer to them.",
    check="Pull the free axis along while someone pulls on the other one: it goes harder.",
    looks_like="more friction on one axis while the other one is pulled",
    state="load",
    claims={"odd": True, "dissipative": True},
)
