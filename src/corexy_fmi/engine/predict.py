"""What a fit foretells of a run that it has not seen, its parameters being as sure as they are.

A right model whose parameters training left vague misses other motions by more than noise, and a
wrong one with vaguer parameters would still be told by it.  So held-out runs are judged by their
predictive likelihood: parameters may move as far as training lets them, and what the fit would then
gain is paid for by the volume that it gains it in (Laplace's approximation; MacKay 2003,
Information Theory, Inference, and Learning Algorithms, chapter 27).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fit import ENOUGH, Fit
from corexy_fmi.engine.noise import Noise
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.samples import Run
from corexy_fmi.kernel.call import Array

LEAST = 1e-9  # precision of what nothing is known of
ROUNDS = 4  # Gauss-Newton steps, the first at the fit


def predictive_cost(fit: Fit, run: Run, noise: tuple[Noise, ...], own: Fit) -> float:
    """Minus the log of the predictive likelihood [nats] of a run, up to what all fits share.

    ``own`` is the fit of the run's own nuisances with the parameters of ``fit`` held.
    """
    problem = replace(fit.problem, runs=(run,), noise=(noise,))
    known = dict(zip(fit.problem.keys, fit.u, strict=True))
    known |= dict(zip(own.problem.keys, own.u, strict=True))
    u = np.array([known.get(key, 0.0) for key in problem.keys])
    return _laplace(problem, u, _precision(fit, problem))


def _precision(fit: Fit, problem: Problem) -> Array:
    """What training says of each shared unknown, and the prior of each of the run's own.

    An effect's parameter that training says nothing of is as unsure as its bounds are wide.
    """
    shared, (low, high) = len(problem.unknowns), problem.limits()
    normal = fit.jacobian.T @ fit.jacobian
    rest = normal[shared:, shared:] + LEAST * np.eye(len(normal) - shared)
    across = normal[:shared, shared:]
    learnt = normal[:shared, :shared] - across @ np.linalg.solve(rest, across.T)
    size, axes = np.linalg.eigh(0.5 * (learnt + learnt.T))
    found = np.diag(np.maximum(problem.prior[1] ** 2, LEAST))
    wide = np.diag(12.0 / np.maximum(high - low, 1e-3)[:shared] ** 2)  # of an even spread
    found[:shared, :shared] = (axes * np.maximum(size, LEAST)) @ axes.T + wide
    return np.asarray(found)


def _laplace(problem: Problem, begin: Array, precision: Array) -> float:
    """Cost at the best parameters near, and half the log of how much their volume shrinks."""
    shared, (low, high) = len(problem.unknowns), problem.limits()
    u, best, volume = begin, np.inf, 0.0
    for _ in range(ROUNDS):
        residual, jacobian = problem.linearised(u)
        white, slopes = residual[: -problem.size], jacobian[: -problem.size]
        away = np.concatenate([u[:shared] - begin[:shared], u[shared:]])
        with np.errstate(over="ignore", invalid="ignore"):  # a run that broke down
            cost = 0.5 * float(white @ white) + 0.5 * float(away @ precision @ away)
        if not cost < best - ENOUGH:
            break
        both = precision + slopes.T @ slopes
        best, volume = cost, np.linalg.slogdet(both)[1] - np.linalg.slogdet(precision)[1]
        u = np.clip(u - np.linalg.solve(both, slopes.T @ white + precision @ away), low, high)
    return best + 0.5 * float(volume)
