"""The two belts differ in stiffness (tension, age); their mean stays the nominal one.

    k_belt1 = k (2 + 2 ratio) / (2 + ratio),   k_belt2 = 2 k / (2 + ratio)               [N/m]

Source: Yin et al., IEEE RCAR 2018, eq. (6) with one k_i for each belt.
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter


def stiffness(section_stiffness, belt, ratio):
    """Section stiffness [N/m]; ``belt`` is +1 on belt 1 and -1 on belt 2."""
    return {"section_stiffness": section_stiffness * ((2 + ratio + belt * ratio) / (2 + ratio))}


EFFECT = Effect(
    name="belt_mismatch",
    summary="the belts differ in stiffness (tension)",
    locations=BELTS,
    parameters=(
        Parameter(
            "ratio",
            "1",
            "stiffness of belt 1 over belt 2, less one",
            0.0,
            -0.7,
            2.5,
            (0.15, -0.15),
            size=True,
        ),
    ),
    laws=(Law("belt", stiffness),),
    equation=r"k_{1} = k\,\frac{2 + 2\rho}{2 + \rho},\qquad k_{2} = k\,\frac{2}{2 + \rho}",
    citation="Yin et al. 2018, IEEE RCAR, eq. (6)",
    remedy="Set both belts to the same tension and replace a worn or stretched one in a pair.",
    check="Pluck the longest free span of both belts: the stiffer belt sounds higher.",
    looks_like="x and y pull on each other: a load along one axis deflects the other",
    state="load",
    coordinate="belts",
    claims={"odd": True},
)
