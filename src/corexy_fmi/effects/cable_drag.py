"""A cable, hose or chain pulls the axis towards one place.

    F = -stiffness (q - center)                                                          [N]

Source: Altintas et al., Machine tool feed drives, CIRP Annals 60(2), 2011,
doi:10.1016/j.cirp.2011.05.010 (disturbance forces on an axis).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter


def pull(applied_force, position, stiffness, center):
    """Force [N] along the axis."""
    return {"applied_force": applied_force - stiffness * (position - center)}


def pole(stiffness, carriage):
    """Square [1/s^2] of the frequency of the carriage on its cable."""
    return stiffness / carriage


EFFECT = Effect(
    name="cable_drag",
    summary="a position-dependent pull",
    locations={name: AXES[name] for name in ("x", "y")},
    parameters=(
        Parameter(
            "stiffness", "N/m", "of the cable along the axis", 0.0, 0.0, 1000.0, (30.0,), size=True
        ),
        Parameter("center", "m", "where it does not pull", 0.0, -0.5, 0.5, (0.0, 0.1, -0.1)),
    ),
    laws=(Law("guide", pull),),
    equation=r"F = -k\,(q - c)",
    citation="Altintas et al. 2011, doi:10.1016/j.cirp.2011.05.010",
    remedy="Give the cable a longer loop, guide it in a chain, or fix it nearer to the middle.",
    check="With the belts off, let the axis go at both ends: it pulls towards one place.",
    looks_like="a missing force that grows along the axis",
    state="position",
    pole=pole,
)
