"""Drag that grows with the square of speed: air, or oil that is churned.

    F = -coefficient v |v|                                                               [N]

Source: Hoerner, Fluid-Dynamic Drag, 1965.
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import absolute


def drag(damping, velocity, coefficient):
    """Damping [N s/m] at a speed."""
    return {"damping": damping + coefficient * absolute(velocity)}


EFFECT = Effect(
    name="quadratic_drag",
    summary="drag that grows with speed squared",
    locations=AXES,
    parameters=(
        Parameter(
            "coefficient",
            "N s^2/m^2",
            "drag over speed squared",
            0.0,
            0.0,
            2e4,
            (100.0,),
            size=True,
        ),
    ),
    laws=(Law("guide", drag),),
    equation=r"F = -c\,v\,|v|",
    citation="Hoerner 1965, Fluid-Dynamic Drag",
    remedy="Take less or thinner grease and remove shields that push air; limit the speed.",
    check="Move at one and at two times a speed: the lag more than doubles.",
    looks_like="a lag that grows faster than speed",
    state="speed",
    claims={"odd": True, "dissipative": True},
)
