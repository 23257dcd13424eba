"""Friction that fades while the machine warms up.

    f(t) = f_C (1 + extra_ratio w(t))                                                    [N]
    c(t) = c (1 + viscous extra_ratio w(t))                                          [N s/m]
    w(t) = exp(-max(t - onset, 0) / time_constant)

with t since the run began.  Each run sets in at its own time: a machine is cold until it moves, and
one that moved before begins warmer, as if it had set in before the run did.

Source: Bittencourt, Gunnarsson, J. Dynamic Systems, Measurement, and Control 134(5), 2012,
doi:10.1115/1.4006589 (friction and temperature).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import exp, maximum


def friction(bound, damping, elapsed, extra_ratio, time_constant, onset, viscous):
    """Coulomb bound [N] and viscous damping [N s/m] some time after the start."""
    extra = extra_ratio * exp(-maximum(elapsed - onset, 0) / time_constant)
    return {"bound": bound * (1 + extra), "damping": damping * (1 + viscous * extra)}


EFFECT = Effect(
    name="friction_warmup",
    summary="friction that fades with time",
    locations=AXES,
    parameters=(
        Parameter(
            "extra_ratio",
            "1",
            "Coulomb friction at the start over the warm one, less one",
            0.0,
            0.0,
            20.0,
            (1.0,),
            size=True,
        ),
        Parameter(
            "time_constant",
            "s",
            "in which the excess fades",
            10.0,
            0.1,
            1e4,
            (1.0, 4.0, 20.0),
            log=True,
        ),
        Parameter(
            "onset",
            "s",
            "from the start of a run until it warms up, negative where it was warm by then",
            0.0,
            -1e5,
            1e5,
            (0.0,),
            default=0.0,
            local=True,
            begins=True,
        ),
        share(
            "viscous",
            "the same excess of viscous friction, over that of Coulomb friction",
            upper=10.0,
        ),
    ),
    laws=(Law("guide", friction),),
    equation=r"f(t) = f_C (1 + \rho\, w),\ c(t) = c\,(1 + \beta\rho\, w),\ "
    r"w = e^{-\max(t - t_0, 0)/T}",
    citation="Bittencourt, Gunnarsson 2012, doi:10.1115/1.4006589",
    remedy="Run the machine warm before work, or take a grease that is thin when cold.",
    check="Repeat one slow move from a cold start: the lag shrinks from run to run.",
    looks_like="missing friction at the beginning of a recording that fades",
    state="time",
    claims={"odd": True, "dissipative": True},
)
