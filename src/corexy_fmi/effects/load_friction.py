"""Friction of a guide that grows with the load that the belts put across it.

    f = f_C + coefficient |F_across|,   F_across: the belts' force along the other axis  [N]

Source: Bittencourt, Gunnarsson, J. Dynamic Systems, Measurement, and Control 134(5), 2012,
doi:10.1115/1.4006589 (friction that grows with the load).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import absolute


def friction(bound, across, coefficient):
    """Coulomb bound [N] under a load."""
    return {"bound": bound + coefficient * absolute(across)}


EFFECT = Effect(
    name="load_friction",
    summary="friction that grows with the belts' load across the guide",
    locations=AXES,
    parameters=(
        Parameter("coefficient", "1", "friction over load", 0.0, 0.0, 1.0, (0.1,), size=True),
    ),
    laws=(Law("guide", friction),),
    equation=r"f = f_C + \mu\,|F_\perp|",
    citation="Bittencourt, Gunnarsson 2012, doi:10.1115/1.4006589",
    remedy="Take bearings made for side loads, lubricate them, or bring the belts nearer to them.",
    check="Pull the free axis along while someone pulls on the other one: it goes harder.",
    looks_like="more friction on one axis while the other one is pulled",
    state="load",
    claims={"odd": True, "dissipative": True},
)
