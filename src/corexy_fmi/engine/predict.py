"""What a fit foretells of a run that it has not seen, its parameters being as sure as they are.

A right model whose parameters training left vague misses other motions by more than noise, and a
wrong one with vaguer parameters would still be told by it.  So held-out runs are judged by their
predictive likelihood: parameters may move as far as training lets them, and what the fit would then
gain is paid for by the volume that it gains it in (Laplace's approximation; MacKay 2003,
Information Theory, Inference, and Learning Algorithms, chapter 27).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from corexy_fmi.engine.fit import Fit, minimise
from corexy_fmi.engine.noise import Noise
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.rough import softened, unstuck
from corexy_fmi.engine.samples import Run
from corexy_fmi.kernel.call import Array

LEAST = 1e-9  # precision of what nothing is known of
ROUNDS = 6  # iterations from the fit, more where the ground is rough


def predictive_cost(fit: Fit, run: Run, noise: tuple[Noise, ...], own: Fit) -> float:
    """Minus the log of the predictive likelihood [nats] of a run, up to what all fits share.

    ``own`` is the fit of the run's own nuisances with the parameters of ``fit`` held.
    """
    problem = replace(fit.problem, runs=(run,), noise=(noise,))
    known = dict(zip(fit.problem.keys, fit.u, strict=True))
    known |= dict(zip(own.problem.keys, own.u, strict=True))
    u = np.array([known.get(key, 0.0) for key in problem.keys])
    return _laplace(problem, u, _precision(fit, problem))


@dataclass(frozen=True, eq=False)
class _Posterior:
    """A problem whose prior is what training left: normal about ``begin`` (size,), and ``root``
    (size, size) of its precision.
    """

    problem: Problem
    begin: Array
    root: Array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.problem.size

    def limits(self) -> tuple[Array, Array]:
        """Bounds (size,) of the unknowns."""
        return self.problem.limits()

    def residual(self, sets: Array) -> Array:
        """Whitened residuals with this prior's (sets, samples + size)."""
        found = self.problem.residual(sets)
        found[:, -self.size :] = (sets - self.begin) @ self.root.T
        return found

    def linearised(
        self, u: Array, borrowed: Array | None = None, stretch: float = 1.0
    ) -> tuple[Array, Array]:
        """Residual with this prior's, and its derivative."""
        residual, slopes = self.problem.linearised(u, borrowed, stretch)
        residual[-self.size :] = self.root @ (u - self.begin)
        slopes[-self.size :] = self.root
        return residual, slopes

    def scale_unseen(self, u: Array, jacobian: Array) -> bool:
        """Training has told the common factor as well as it can."""
        return False

    def log_scale(self) -> float:
        """What all fits share."""
        return 0.0


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
    centre = begin.copy()
    centre[len(problem.unknowns) :] = 0.0
    power, axes = np.linalg.eigh(precision)
    root = np.sqrt(np.maximum(power, LEAST))[:, None] * axes.T
    posterior = _Posterior(problem, centre, np.asarray(root))
    fit = softened(unstuck(minimise(cast(Problem, posterior), begin, ROUNDS)))
    if not np.isfinite(fit.cost):
        return float("inf")
    both = np.linalg.slogdet(fit.jacobian.T @ fit.jacobian)[1]
    return fit.cost + 0.5 * float(both - np.linalg.slogdet(precision)[1])
