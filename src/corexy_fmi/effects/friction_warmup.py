"""Friction that fades while the machine warms up.

    f(t) = f_C (1 + extra_ratio exp(-t / time_constant)),   t since the run began        [N]

Source: Bittencourt, Gunnarsson, J. Dynamic Systems, Measurement, and Control 134(5), 2012,
doi:10.1115/1.4006589 (friction and temperature).
"""

from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp


def friction(bound, elapsed, extra_ratio, time_constant):
    """Coulomb bound [N] some time after the start."""
    return {"bound": bound * (1 + extra_ratio * exp(-elapsed / time_constant))}


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
    ),
    laws=(Law("guide", friction),),
    equation=r"f(t) = f_C \left(1 + \rho\, e^{-t/T}\right)",
    citation="Bittencourt, Gunnarsson 2012, doi:10.1115/1.4006589",
    remedy="Run the machine warm before work, or take a grease that is thin when cold.",
    check="Repeat one slow move from a cold start: the lag shrinks from run to run.",
    looks_like="missing friction at the beginning of a recording that fades",
    state="time",
    claims={"odd": True, "dissipative": True},
)
