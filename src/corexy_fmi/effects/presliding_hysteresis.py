"""Bristles bend before a guide slides: Coulomb friction grows with displacement, with hysteresis.

Dahl's fade as they bend, and after a reversal begin twice as stiff:

    dF/dx = s (1 - F sgn(v) / f_C),   exactly integrated over each step                  [N/m]

Maxwell's slip one by one, each at its own yield y_k f_C / s, and keep to Masing's rule; theirs are
four quarters of the friction, with the yields that bend by Dahl's curve from rest:

    F = sum_k F_k,   dF_k/dx = s / (4 y_k),   |F_k| <= f_C / 4,   sum_k 1 / (4 y_k) = 1

Both take the place of the set-valued friction, whose bound f_C they keep.

Source: Dahl, A Solid Friction Model, Aerospace Corporation TOR-0158(3107-18)-1, 1968; Canudas de
Wit et al., IEEE Trans. Automatic Control 40(3), 1995, doi:10.1109/9.376053 (LuGre); Al-Bender,
Lampaert, Swevers, IEEE Trans. Automatic Control 50(11), 2005, doi:10.1109/TAC.2005.858676
(Maxwell slip).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import absolute, exp, maximum, minimum, select

# medians of the quarters of the distribution y exp(-y), by which yields bend by Dahl's curve
YIELDS = (0.48089, 1.02995, 1.67143, 2.84646)


def start(position):
    """The bristles begin unbent."""
    free = 0 * position
    slips = {"slip1": free, "slip2": free, "slip3": free, "slip4": free}
    return {"pull": free, **slips, "last": position}


def bristle(
    bound, applied_force, position, pull, slip1, slip2, slip3, slip4, last, stiffness, maxwell_slip
):
    """Force [N] of the bristles after the displacement since the last step."""
    limit, moved = maximum(bound, 0), position - last
    fade = exp(-stiffness * absolute(moved) / maximum(limit, 1e-12))
    goal = select(moved > 0, limit, -limit)
    bent = minimum(maximum(goal + (pull - goal) * fade, -limit), limit)
    one, two, three, four = (
        minimum(maximum(slip + stiffness * moved / (4 * reach), -limit / 4), limit / 4)
        for slip, reach in zip((slip1, slip2, slip3, slip4), YIELDS, strict=True)
    )
    force = bent + maxwell_slip * (one + two + three + four - bent)
    on = stiffness > 0
    return {
        "bound": select(on, 0 * bound, bound),
        "applied_force": select(on, applied_force - force, applied_force),
        "pull": bent,
        "slip1": one,
        "slip2": two,
        "slip3": three,
        "slip4": four,
        "last": position,
    }


def pole(stiffness, carriage):
    """Square [1/s^2] of the frequency of the carriage on its bristles."""
    return stiffness / carriage


EFFECT = Effect(
    name="presliding_hysteresis",
    summary="bristle compliance before sliding (Dahl, LuGre, Maxwell slip)",
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
        share(
            "maxwell_slip",
            "0: bristles fade as Dahl's, 1: they slip one by one as Maxwell's",
            starts=(0.0,),
        ),
    ),
    laws=(Law("start_axis", start), Law("stick", bristle)),
    equation=r"\frac{dF}{dx} = s \left(1 - \frac{F}{f_C}\,\mathrm{sgn}\,\dot x\right)\quad"
    r"\text{or}\quad F = \sum_k F_k,\ \frac{dF_k}{dx} = \frac{s}{4 y_k},\ |F_k| \leq \frac{f_C}{4}",
    citation="Dahl 1968, TOR-0158; Canudas de Wit et al. 1995, doi:10.1109/9.376053; "
    "Al-Bender, Lampaert, Swevers 2005, doi:10.1109/TAC.2005.858676",
    remedy="Use a stiffer guide or less preload and grease; compensate short reversals.",
    check="Push the free axis lightly and let go: it springs back without having slid.",
    looks_like="friction that builds up over some micrometres after each reversal, not at once",
    state="velocity_reversal",
    memory=("pull", "slip1", "slip2", "slip3", "slip4", "last"),
    pole=pole,
    claims={"odd": True},
)
