"""Does a cause that fades in time fade while it is recorded?

A friction that has not begun to warm up, neither in one recording nor between two, is friction
further off the machine file than its priors allow: more viscous friction may pass for a lag of the
sensor, and no prior holds back what stands for it.
"""

from __future__ import annotations

from corexy_fmi.engine.fitting.fit import AGAIN, Fit, minimise
from corexy_fmi.engine.naming.entries import THRESHOLD
from corexy_fmi.kernel.layout import Instance


def unchanging(fit: Fit) -> str:
    """What must be said of a settled fit of an effect that changes with time, if it is as good
    where that has not begun in any recording; else nothing.
    """
    for instance in fit.problem.hypothesis.uses:
        begins = _begins(fit, instance)
        if begins and _never(fit, begins).cost < fit.cost + THRESHOLD:
            return f"{instance.effect.name} changes nothing while it is recorded"
    return ""


def _begins(fit: Fit, instance: Instance) -> list[int]:
    """Where an effect's beginnings stand among the unknowns of a fit."""
    head = f"{instance.effect.name}.{instance.location}."
    names = {head + p.name for p in instance.effect.parameters if p.begins}
    return [k for k, key in enumerate(fit.problem.keys) if key.partition("@")[0] in names]


def _never(fit: Fit, begins: list[int]) -> Fit:
    """The fit carried on from where nothing has begun."""
    u = fit.u.copy()
    u[begins] = fit.problem.limits()[1][begins]
    return minimise(fit.problem, u, AGAIN)
