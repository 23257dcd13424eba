"""Section stiffness follows the real section lengths as the carriage moves.

With strength 1 it is k_i = A E / l_i; below, a part stays constant, behind the section (clamps and
teeth give too) or beside it:

    behind: k_i = A E / (l_0 + s (l - l_0))      beside: k_i = (A E / l_0) (1 - s + s l_0 / l)
    k_i = (1 - parallel) behind + parallel beside,      V = sum k_i e_i^2 / 2 with all derivatives

Source: Yin et al., IEEE RCAR 2018: k_i = A E / l_i, which the paper then holds constant.
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter, share


def stiffness(section_stiffness, slope, length, centre_length, strength, parallel):
    """Stiffness [N/m] and its slope [N/m^2] over the section's length."""
    effective = centre_length + strength * (length - centre_length)
    real = centre_length / length
    behind, beside = centre_length / effective, 1 - strength + strength * real
    ratio = behind + parallel * (beside - behind)
    bent = (1 - parallel) * behind * strength / effective + parallel * strength * real / length
    return {
        "section_stiffness": section_stiffness * ratio,
        "slope": slope * ratio - section_stiffness * bent,
    }


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
        share(
            "parallel",
            "share of the constant part that lies beside the section instead of behind it",
        ),
    ),
    laws=(Law("belt", stiffness),),
    equation=(
        r"k_i = \frac{(1 - p)\,A E}{l_{i,0} + s\,(l_i(x, y) - l_{i,0})}"
        r" + p\,\frac{A E}{l_{i,0}}\left(1 - s + s \frac{l_{i,0}}{l_i}\right),"
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
