"""Least squares with bounds: Levenberg-Marquardt whose trial steps run as lanes of one call."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from corexy_fmi.engine.fitting.noise import Noises, quick_noise, size, white
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.quiet import own_models
from corexy_fmi.engine.fitting.slopes import BROKEN
from corexy_fmi.kernel.call import Array

DAMPINGS = np.array([0.0, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 100.0])
Mapper = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]
ENOUGH = 0.05  # [nats] an iteration that gains less ends the fit
AGAIN = 8  # iterations under a noise that a fit had before
HIDDEN = 0.5  # [nats] that another micro-step may change at the end


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis: u (size,), the cost [nats] with noise scale and priors.

    ``slopes`` stand for its Jacobian where given.  None is kept of a fit's way: of six minutes at
    1 kHz it takes 100 MB and more.
    """

    problem: Problem
    u: Array
    cost: float
    residual: Array
    slopes: Array | None = None

    @cached_property
    def jacobian(self) -> Array:
        """Derivative (samples + size, size) of the residual at u."""
        if not np.isfinite(self.cost):
            return np.zeros((len(self.residual), self.problem.size))
        return self.problem.linearised(self.u)[1] if self.slopes is None else self.slopes

    def value(self, key: str) -> float:
        """Physical value of an unknown by its key."""
        names = [x.key for x in self.problem.unknowns]
        k = names.index(key)
        return float(self.problem.unknowns[k].value(self.u[k]))


def _directions(jacobian: Array, residual: Array, free: np.ndarray) -> Array:
    """One step (size,) for each damping, zero where a bound holds."""
    normal, gradient = (jacobian.T @ jacobian)[np.ix_(free, free)], (residual @ jacobian)[free]
    scale = np.diag(normal) + 1e-12 * np.trace(normal) + 1e-300
    steps = np.zeros((len(DAMPINGS), jacobian.shape[1]))
    for n, damping in enumerate(DAMPINGS):
        steps[n, free] = -np.linalg.solve(normal + np.diag((damping + 1e-10) * scale), gradient)
    return steps


def _at_bound(u: Array, gradient: Array, low: Array, high: Array) -> np.ndarray:
    return ((u <= low) & (gradient > 0)) | ((u >= high) & (gradient < 0))


def costs(residuals: Array) -> Array:
    """Half the squared norm of each residual (sets, n) [nats]; infinite where a run broke down."""
    with np.errstate(over="ignore", invalid="ignore"):
        found = 0.5 * np.einsum("ij,ij->i", residuals, residuals)
    return np.where(np.isfinite(found), found, np.inf)


def minimise(
    problem: Problem,
    start: Array,
    iterations: int = 12,
    enough: float = ENOUGH,
    borrowed: Array | None = None,
    secants: int = 0,
    stretch: float = 1.0,
) -> Fit:
    """Fit from a start (size,); deterministic, and monotone in cost.

    An iteration computes a Jacobian, or takes what is not NaN of ``borrowed``, one from nearby, and
    steps by it; then up to ``secants`` times by Broyden's update of it (doi:10.1090/S0025-5718-1965
    -0198670-6).  ``stretch`` lengthens the differences (`rough.py`).
    """
    low, high = problem.limits()
    u = np.clip(start, low, high)
    residual = problem.residual(u[None])[0] if iterations == 0 else np.empty(0)
    for n in range(iterations):
        residual, jacobian = problem.linearised(u, borrowed if n == 0 else None, stretch)
        if not np.isfinite(costs(residual[None])[0]):  # it broke down
            return Fit(problem, u, np.inf, residual)
        before = 0.5 * float(residual @ residual)
        for k in range(1 + secants):
            step, after, gain = stepped(problem, u, residual, jacobian, (low, high))
            more = gain > enough and k < secants and bool(step.any())
            if more:
                unforeseen = after - residual - jacobian @ step
                jacobian = jacobian + np.outer(step / (step @ step), unforeseen).T
            if gain > 0:
                u, residual = u + step, after
            if not more:
                break
        if before - 0.5 * float(residual @ residual) < enough and (n > 0 or borrowed is None):
            break
    return Fit(problem, u, 0.5 * float(residual @ residual) + problem.log_scale(), residual)


def stepped(
    problem: Problem, u: Array, residual: Array, jacobian: Array, limits: tuple[Array, Array]
) -> tuple[Array, Array, float]:
    """The best of all dampings' steps within limits: step, residual behind it, gain [nats]."""
    free = ~_at_bound(u, jacobian.T @ residual, *limits)
    trials = u + _directions(jacobian, residual, free)
    if problem.scale_unseen(u, jacobian):
        trials = problem.eased(trials)
    trials = np.clip(trials, *limits)
    results = problem.residual(trials)
    tried = costs(results)
    best = int(np.argmin(tried))
    gain = 0.5 * float(residual @ residual) - float(tried[best])
    return trials[best] - u, results[best].copy(), gain  # a view would keep all of the trials


def own_noise(fit: Fit) -> Problem:
    """The same problem with the noise that this fit's own residuals show, up to the ceiling; as it
    is where a run breaks down, which one lane may do where eight did not.
    """
    runs = fit.problem.runs
    errors = [[e[0] for e in fit.problem.errors(fit.u[None], r)] for r in range(len(runs))]
    if not all(np.abs(e).max(initial=0.0) < BROKEN for own in errors for e in own):
        return fit.problem
    noise, most = own_models(runs, errors), fit.problem.ceiling
    return replace(fit.problem, noise=most if most and size(most) < size(noise) else noise)


def white_noise(fit: Fit) -> Problem:
    """The same problem under white noise as small as the samples' quickest part allows."""
    noise = tuple(tuple(white(quick_noise(s)) for s in run.samples) for run in fit.problem.runs)
    return replace(fit.problem, noise=noise)


def settle(fit: Fit, rounds: int = 2, iterations: int = 6) -> Fit:
    """Alternate between the noise of the residuals and the fit under that noise; a fit that breaks
    down under it stays as it was.
    """
    for _ in range(rounds if np.isfinite(fit.cost) else 0):
        again = minimise(own_noise(fit), fit.u, iterations)
        if not np.isfinite(again.cost):
            break
        fit = again
    return fit


def settle_no_dearer(fit: Fit, beside: Noises | None = None) -> Fit:
    """A fit settled, or under the noise that it began with, or that ``beside``, where it costs less
    in the end under that and no ceiling forbids it.

    A recording that a fit makes quiet has its noise held against the others (`quiet.py`): a pair
    that explained lost steps cost 12 400 nats more than a run-out that took them for noise.
    """
    ended, noise, most = settle(fit), beside or fit.problem.noise, fit.problem.ceiling
    if most and size(most) < size(noise):
        return ended
    problem = replace(ended.problem, noise=noise)
    if not minimise(problem, ended.u, 0).cost < ended.cost:
        return ended
    return minimise(problem, ended.u, AGAIN)


def hides(problem: Problem, other: Problem, u: Array, most: float = HIDDEN) -> bool:
    """Whether the noise hides what another micro-step changes at u (size,), up to most [nats]."""
    change = other.residual(u[None]) - problem.residual(u[None])
    return bool(costs(change)[0] < most)


def fine(fit: Fit) -> Fit:
    """The fit at the micro-step that its machine and effects need, where that shows."""
    problem = replace(fit.problem, coarse=1.0)
    if problem.limit == fit.problem.limit or hides(problem, fit.problem, fit.u):
        return fit
    return minimise(problem, fit.u)
