"""What lies beyond retuning: of a fit's residual, and of changes of it.

A change is seen through its product with what is left of the residual and those with other changes;
both follow from its products with q, so that no change need be projected itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.kernel.call import Array

WITHIN = 1e-12  # share of a change's square below which what is beyond is rounding


@dataclass(frozen=True, eq=False)
class Beyond:
    """``q`` (samples + size, size), orthonormal: what retuning can do to ``fit``'s residual.
    ``along`` (size,): the residual along q.
    """

    fit: Fit
    q: Array
    along: Array

    @property
    def samples(self) -> int:
        """How many rows are samples; the priors stand behind them, and no change moves them."""
        return len(self.q) - self.fit.problem.size

    def of(self, changes: Array, part: slice | None = None) -> tuple[Array, Array]:
        """Products (sets,) of changes (sets, samples) with what is left of the residual, and with
        each other (sets, sets), all beyond retuning; ``part``: the samples that they move alone.
        """
        rows = part or slice(0, self.samples)
        along = changes @ self.q[rows]
        products = changes @ self.fit.residual[rows] - along @ self.along
        whole = changes @ changes.T
        gram = whole - along @ along.T
        np.fill_diagonal(gram, np.maximum(np.diag(gram), WITHIN * np.diag(whole)))
        return products, gram

    @cached_property
    def along_unknowns(self) -> Array:
        """The fit's Jacobian along q, (size, size)."""
        return np.asarray(self.q.T @ self.fit.jacobian)

    def given_way(self, changes: Array) -> Array:
        """How far the unknowns (sets, size) go to hide changes (sets, samples) best, linearly."""
        along = changes @ self.q[: self.samples]
        return np.asarray(-np.linalg.lstsq(self.along_unknowns, along.T, rcond=None)[0].T)

    def gains(self, white: Array) -> Array:
        """Gain [nats] (sets,) of whitened errors (sets, samples) over the fit's, retuned linearly;
        the pulls of the priors stay as they are.
        """
        behind = self.fit.residual[self.samples :]
        with np.errstate(over="ignore", invalid="ignore"):  # runs that broke down
            along = white @ self.q[: self.samples] + behind @ self.q[self.samples :]
            square = np.einsum("ij,ij->i", white, white) + behind @ behind
            left = square - np.einsum("ij,ij->i", along, along)
        own = float(self.fit.residual @ self.fit.residual - self.along @ self.along)
        return 0.5 * own - 0.5 * np.where(np.isfinite(left), left, np.inf)

    def off(self, changes: Array) -> Array:
        """Changes (sets, samples) themselves, off what retuning can do, (sets, samples + size)."""
        found = (changes @ -self.q[: self.samples]) @ self.q.T
        found[:, : self.samples] += changes
        return np.asarray(found)


def at_step_of(behind: Beyond, problem: Problem) -> Beyond:
    """The same with the fit's residual at another problem's micro-step: what that changes is no
    effect's.
    """
    own = behind.fit.problem
    if problem.limit == own.limit:
        return behind
    finer = replace(own, coarse=own.coarse * problem.limit / own.limit)
    fit = replace(behind.fit, residual=finer.residual(behind.fit.u[None])[0])
    return Beyond(fit, behind.q, behind.q.T @ fit.residual)


def beyond(fit: Fit) -> Beyond:
    """What lies beyond retuning of a fit."""
    q, _ = np.linalg.qr(fit.jacobian)
    return Beyond(fit, q, q.T @ fit.residual)


def gain_one(product: float, power: float) -> tuple[float, float]:
    """Gain [nats] and factor of one signature (`Beyond.of`)."""
    factor = -product / power if power > 1e-12 else 0.0
    return 0.5 * factor**2 * power, factor


def gain_many(products: Array, gram: Array) -> tuple[float, Array]:
    """Gain and factors of several signatures (`Beyond.of`) together, lightly ridged."""
    ridge = 1e-6 * np.trace(gram) / len(gram) + 1e-9
    factors = -np.linalg.solve(gram + ridge * np.eye(len(gram)), products)
    return -float(factors @ products + 0.5 * factors @ gram @ factors), factors
