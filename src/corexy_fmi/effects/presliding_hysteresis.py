"""Bristles bend before a guide slides: Coulomb friction grows with displacement, with hysteresis.

    dF/dx = s (1 - F sgn(v) / f_C),   exactly integrated over each step                  [N/m]

It takes the place of the set-valued friction, whose bound f_C it keeps.

Source: Dahl, A Solid Friction Model, Aerospace Corporation TOR-0158(3107-18)-1, 1968; Canudas de
Wit et al., IEEE Trans. Automatic Control 40(3), 1995, doi:10.1109/9.376053 (LuGre).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import absolute, exp, maximum, minimum, select


def start(position):
    """The bristles begin unbent."""
    return {"pull": 0 * position, "last": position}


def bristle(bound, applied_force, position, pull, last, stiffness):
    """Force [N] of the bristles after the displacement since the last step."""
    limit, moved = maximum(bound, 0), position - last
    fade = exp(-stiffness * absolute(moved) / maximum(limit, 1e-12))
    goal = select(moved > 0, limit, -limit)
    bent = minimum(maximum(goal + (pull - goal) * fade, -limit), limit)
    on = stiffness > 0
    return {
        "bound": select(on, 0 * bound, bound),
        "applied_force": select(on, applied_force - bent, applied_force),
        "pull": bent,
        "last": position,
    }


def pole(stiffness, carriage):
    """Square [1/s^2] of the frequency of the carriage on its bristles."""
    return stiffness / carriage


EFFECT = Effect(
    name="presliding_hysteresis",
    summary="bristle compliance before sliding (Dahl, LuGre)",
    locations=AXES,
    parameters=(
        Parameter(
            "stiffness",
            "N/m",
            "of the bristles; 0 switches the effect off (rigid)",
            0.0,
            50.0,
            1e7,
            (2e3, 8e3, 3e4, 2e5),
            size=True,
            log=True,
            scaling=-1,
        ),
    ),
    laws=(Law("start_axis", start), Law("stick", bristle)),
    equation=r"\frac{dF}{dx} = s \left(1 - \frac{F}{f_C}\,\mathrm{sgn}\,\dot x\right)",
    citation="Dahl 1968, TOR-0158; Canudas de Wit et al. 1995, doi:10.1109/9.376053",
    remedy="Use a stiffer guide or less preload and grease; compensate short reversals.",
    check="Push the free axis lightly and let go: it springs back without having slid.",
    looks_like="friction that builds up over some micrometres after each reversal, not at once",
    state="velocity_reversal",
    memory=("pull", "last"),
    pole=pole,
    claims={"odd": True},
)
