"""Where a search begins: from the retuned machine, and from where that may have been led away.

A slow mismatch can pass for coloured noise, a lag for soft belts, and what is strong bends the
nominal parameters so far that its own signature is lost.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, costs, minimise, white_noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import STIFFNESS, Hypothesis
from corexy_fmi.kernel.call import Array

AHEAD, AHEAD_BLEACHED = 16, 6  # short fits from the retuned machine, from each other start
LAGS = ("speed", "acceleration", "load", "velocity_reversal", "voltage")  # what soft belts pass for
STIFFER = 1.2  # log of the factor
LOST = 3.0  # prior standard deviations of a nominal parameter
STEADY, UNREST = "constant", 1.0  # a state; prior deviations of how a run began


def starts(
    base: Fit, candidates: list[Hypothesis], first: bool
) -> Iterator[tuple[Fit, list[Hypothesis], int]]:
    """Where a round searches from, for which candidates, with how many short fits."""
    yield base, candidates, AHEAD
    yield from ((fit, candidates, AHEAD_BLEACHED) for fit in _bleached(base))
    if first:
        lagging = [h for h in candidates if any(i.effect.state in LAGS for i in h.uses)]
        yield from ((fit, candidates, AHEAD_BLEACHED) for fit in central(base))
        yield from ((fit, lagging, AHEAD_BLEACHED) for fit in stiffer(base))
        steady = [h for h in candidates if any(i.effect.state == STEADY for i in h.uses)]
        yield from ((fit, steady, AHEAD_BLEACHED) for fit in rested(base) if steady)


def _bleached(base: Fit) -> list[Fit]:
    """The base fitted again under white noise; nothing where its own noise is white already."""
    if not any(len(n.coefficients) for models in base.problem.noise for n in models):
        return []
    return [minimise(white_noise(base), base.u, 8)]


def stiffer(base: Fit) -> list[Fit]:
    """The base with its belts stiffened, which a search from there holds; nothing where the
    machine file says how stiff they are, or where they are too stiff for the micro-step.
    """
    u = stiffened(base.problem, base.u)
    if u is None:
        return []
    k = base.problem.keys.index(STIFFNESS)
    residual, slopes = base.problem.linearised(u)
    slopes[:, k] = 0.0
    return _linear(base.problem, u, residual, slopes)


def stiffened(problem: Problem, u: Array) -> Array | None:
    """u (size,) with stiffer belts; None where the machine file says how stiff they are."""
    if STIFFNESS not in problem.keys:
        return None
    k, stiff = problem.keys.index(STIFFNESS), u.copy()
    stiff[k] = min(stiff[k] + STIFFER, problem.limits()[1][k])
    return stiff


def central(base: Fit) -> list[Fit]:
    """The base with the machine file's nominal parameters, under white noise, where retuning went
    astray: what is strong bends them so far that its own signature is lost.
    """
    if astray(base) < LOST:
        return []
    problem = white_noise(base)
    u = centred(base)
    return _linear(problem, u, *problem.linearised(u))


def rested(base: Fit) -> list[Fit]:
    """The base with every run begun in balance, where retuning found one far from it: that passes
    for a steady pull, from which it then keeps a search.
    """
    u = balanced(base)
    return [] if u is None else _linear(base.problem, u, *base.problem.linearised(u))


def balanced(fit: Fit) -> Array | None:
    """u (size,) of a fit with every run begun in balance; None where none began far from it."""
    problem, u = fit.problem, fit.u.copy()
    known = set(problem.rest_keys)
    rest = [k for k, key in enumerate(problem.keys) if key.partition(" of run ")[0] in known]
    if not rest or np.abs(u[rest]).max() < UNREST:
        return None
    u[rest] = 0.0
    return u


def _linear(problem: Problem, u: Array, residual: Array, slopes: Array) -> list[Fit]:
    """A fit that was not carried on; nothing where the run breaks down there."""
    cost = float(costs(residual[None])[0]) + problem.log_scale()
    return [Fit(problem, u, cost, residual, slopes)] if np.isfinite(cost) else []


def astray(fit: Fit) -> float:
    """How far the nominal parameters of a fit are off the machine file at most, in prior
    standard deviations.
    """
    return float(max(pulls(fit), default=0.0))


def pulls(fit: Fit) -> Array:
    """How far each nominal parameter of a fit is off the machine file, in prior standard
    deviations.
    """
    known = fit.problem.unknowns[: fit.problem.nominal_count]
    return np.array([abs(fit.u[k]) / x.prior_std for k, x in enumerate(known)])


def centred(fit: Fit) -> Array:
    """u (size,) of a fit, its nominal parameters as the machine file has them."""
    return np.where(np.arange(len(fit.u)) < fit.problem.nominal_count, 0.0, fit.u)
