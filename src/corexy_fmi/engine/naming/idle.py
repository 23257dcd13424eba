"""Effects that come along for nothing: what is gained is gained without their size.

Some effects hold another: detent torque in a rotor that its field holds softly is, without the
torque, that soft field alone.  Such a fit is as good as the smaller one's, and no rival of it.
"""

from __future__ import annotations

from dataclasses import replace

from corexy_fmi.engine.fitting.fit import Fit, costs, minimise, settle_no_dearer
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

FAINT, FAINT_ENOUGH = 1e-3, 0.1  # of the effect; share that bounds may leave of it


def idle(fit: Fit, least: float) -> bool:
    """Whether one of the fit's effects, made faint, loses less than ``least`` [nats]."""
    return any(_loss(fit, instance) < least for instance in fit.problem.hypothesis.uses)


def lighter(fit: Fit, least: float) -> Fit:
    """A fit of several effects without those that it loses less than ``least`` [nats] without, one
    at a time; settled.
    """
    uses = fit.problem.hypothesis.uses if len(fit.problem.hypothesis.uses) > 1 else ()
    for instance in uses:
        problem, u = _without(fit, instance)
        if _cost_more(fit, problem, u) < least:
            return lighter(settle_no_dearer(minimise(problem, u)), least)
    return fit


def _loss(fit: Fit, instance: Instance) -> float:
    """What the fit loses [nats] where an effect's sizes go to a thousandth of their effect; where
    bounds do not let them, without it.
    """
    u, head = fit.u.copy(), f"{instance.effect.name}.{instance.location}."
    sizes = {head + p.name: p for p in instance.effect.sizes}
    for k, unknown in enumerate(fit.problem.unknowns):
        p = sizes.get(unknown.key.split("@")[0])
        if p is None:
            continue
        value = float(unknown.value(u[k]))
        faint = value * FAINT**p.scaling if p.log else p.neutral + FAINT * (value - p.neutral)
        u[k] = unknown.internal(faint)
        if not _is_faint(value, float(unknown.value(u[k])), p.neutral, p.scaling):
            return _cost_more(fit, *_without(fit, instance))
    return _cost_more(fit, fit.problem, u)


def _without(fit: Fit, instance: Instance) -> tuple[Problem, Array]:
    """The fit's problem and unknowns (size,) without an effect: bristles almost as stiff as their
    range allows are rigid already.
    """
    said = fit.problem.hypothesis
    uses = tuple(use for use in said.uses if use is not instance)
    problem = replace(fit.problem, hypothesis=replace(said, uses=uses))
    return problem, problem.carried(fit.problem, fit.u)


def _cost_more(fit: Fit, problem: Problem, u: Array) -> float:
    """What unknowns of a problem cost more [nats] than the fit."""
    found = problem.residual(u[None])
    return float(costs(found)[0]) - 0.5 * float(fit.residual @ fit.residual)


def _is_faint(before: float, after: float, neutral: float, scaling: int) -> bool:
    """Whether bounds let a size go far enough."""
    if scaling < 0:
        return before <= FAINT_ENOUGH * after
    return scaling > 0 and abs(after - neutral) <= FAINT_ENOUGH * abs(before - neutral)
