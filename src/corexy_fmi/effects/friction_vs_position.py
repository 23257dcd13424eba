"""A tight spot on a rail: Coulomb friction that is larger around one place.

    f(q) = f_C + extra exp(-(q - center)^2 / (2 width^2))                                [N]

Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994,
doi:10.1016/0005-1098(94)90209-7 (friction that depends on position).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp


def friction(bound, position, extra, center, width):
    """Coulomb bound [N] at a place of the rail."""
    return {"bound": bound + extra * exp(-(((position - center) / width) ** 2) / 2)}


EFFECT = Effect(
    name="friction_vs_position",
    summary="a tight spot on a rail",
    locations={name: AXES[name] for name in ("x", "y")},
    parameters=(
        Parameter(
            "extra",
            "N",
            "friction at the spot beyond the rest of the rail's",
            0.0,
            0.0,
            50.0,
            (0.5,),
            size=True,
        ),
        Parameter("center", "m", "middle of the spot", 0.0, -0.5, 0.5, (0.01,), over="position"),
        Parameter(
            "width", "m", "Gaussian sigma of the spot", 0.01, 5e-4, 0.2, (0.003, 0.01), log=True
        ),
    ),
    laws=(Law("guide", friction),),
    equation=r"f(q) = f_C + a\, e^{-(q - c)^2 / 2 w^2}",
    citation="Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7",
    remedy="Clean the rail there, look for a dent or a misaligned joint, align both rails.",
    check="Push the free axis slowly along its rail by hand: it goes hard at that place.",
    looks_like="missing friction whenever the axis passes one place, in either direction",
    state="position",
    claims={"odd": False, "dissipative": True},
)
