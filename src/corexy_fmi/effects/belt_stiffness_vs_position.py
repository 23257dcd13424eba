"""Section stiffness follows the real section lengths as the carriage moves.

    k_i = A E / (l_0 + strength (l(x, y) - l_0)),  V = sum k_i e_i^2 / 2 with all derivatives

Source: Yin et al., IEEE RCAR 2018: k_i = A E / l_i, which the paper then holds constant.
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter


def stiffness(section_stiffness, slope, length, centre_length, strength):
    """Stiffness [N/m] and its slope [N/m^2] over the section's length."""
    effective = centre_length + strength * (length - centre_length)
    ratio = centre_length / effective
    new = section_stiffness * ratio
    return {"section_stiffness": new, "slope": slope * ratio - new * strength / effective}


EFFECT = Effect(
    name="belt_stiffness_vs_position",
    summary="belt stiffness follows the real section lengths",
    locations=BELTS,
    parameters=(
        Parameter(
            "strength",
            "1",
            "0: constant as in the paper, 1: real lengths",
            0.0,
            0.0,
            1.0,
            (0.5, 1.0),
            size=True,
        ),
    ),
    laws=(Law("belt", stiffness),),
    equation=(
        r"k_i = \frac{A E}{l_{i,0} + s\,(l_i(x, y) - l_{i,0})},"
        r"\quad V = \sum_i \frac{1}{2} k_i e_i^2"
    ),
    citation="Yin et al. 2018, IEEE RCAR, k_i = A E / l_i",
    remedy="Nothing is broken: use a stiffer belt, or compensate by position in the controller.",
    check="Push the carriage with one force at the centre and near a corner: it gives unequally.",
    looks_like="the lag grows or shrinks with position, and the axes couple away from the centre",
    state="position",
    coordinate="belts",
    fidelities=("full",),
)
