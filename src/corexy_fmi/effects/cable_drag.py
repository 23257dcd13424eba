"""A cable, hose or chain pulls the axis towards one place.

    F = -stiffness d (1 + stiffening min(d^2, (0.3 m)^2)),  d = q - center               [N]

A loop that is nearly stretched stiffens.

Source: Altintas et al., Machine tool feed drives, CIRP Annals 60(2), 2011,
doi:10.1016/j.cirp.2011.05.010 (disturbance forces on an axis).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import minimum

REACH = 0.3  # [m] off its centre, up to which it stiffens


def pull(applied_force, position, stiffness, center, stiffening):
    """Force [N] along the axis."""
    away = position - center
    grown = 1 + stiffening * minimum(away * away, REACH * REACH)
    return {"applied_force": applied_force - stiffness * away * grown}


def pole(stiffness, stiffening, carriage):
    """Square [1/s^2] of the frequency of the carriage on its cable."""
    return stiffness * (1 + 3 * REACH * REACH * stiffening) / carriage


EFFECT = Effect(
    name="cable_drag",
    summary="a position-dependent pull",
    locations={name: AXES[name] for name in ("x", "y")},
    parameters=(
        Parameter(
            "stiffness", "N/m", "of the cable along the axis", 0.0, 0.0, 1000.0, (30.0,), size=True
        ),
        Parameter("center", "m", "where it does not pull", 0.0, -0.5, 0.5, (0.0, 0.1, -0.1)),
        Parameter(
            "stiffening",
            "1/m^2",
            "growth of the stiffness with the square of the way",
            0.0,
            0.0,
            300.0,
            (0.0, 100.0),
            default=0.0,
            family_ends=True,
        ),
    ),
    laws=(Law("guide", pull),),
    equation=r"F = -k\,d\,(1 + s \min(d^2, d_0^2)),\ d = q - c,\ d_0 = 0.3\,\mathrm{m}",
    citation="Altintas et al. 2011, doi:10.1016/j.cirp.2011.05.010",
    remedy="Give the cable a longer loop, guide it in a chain, or fix it nearer to the middle.",
    check="With the belts off, let the axis go at both ends: it pulls towards one place.",
    looks_like="a missing force that grows along the axis",
    state="position",
    pole=pole,
)
