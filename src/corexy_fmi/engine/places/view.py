"""A fit's errors, its slopes, and small changes of its outputs, seen through any noise.

All is linear around the fit: what retuning can do is projected out, and what is left of errors and
changes once some of these are fitted is known without another simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.noise import Noise, white
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.kernel.call import Array

TOGETHER = 32  # changes that are projected at once: as many in double precision take some room
SINGULAR = 1e-10  # share of the greatest slope below which one tells nothing

Models = tuple[tuple[Noise, ...], ...]  # of each channel of each run


def plain(fit: Fit) -> Fit:
    """The fit with residuals as they are, their means aside: not whitened."""
    noise = tuple(tuple(white(1.0) for _ in run.samples) for run in fit.problem.runs)
    problem = replace(fit.problem, noise=noise)
    residual = problem.residual(fit.u[None])[0]
    return Fit(problem, fit.u, 0.5 * float(residual @ residual), residual)


@dataclass(frozen=True, eq=False)
class View:
    """A plain fit through a noise."""

    fit: Fit
    noise: Models

    @cached_property
    def problem(self) -> Problem:
        """The fit's problem with that noise."""
        return replace(self.fit.problem, noise=self.noise)

    @cached_property
    def slopes(self) -> tuple[Array, Array]:
        """Orthonormal q (samples + size, size) of what retuning can do, and its factor r."""
        q, r = np.linalg.qr(self._whitened(self.fit.jacobian.T).T)
        return q, r

    @cached_property
    def residual(self) -> Array:
        """Whitened residual (samples + size,) off what retuning can do."""
        white, (q, _) = self._whitened(self.fit.residual[None])[0], self.slopes
        return np.asarray(white - q @ (q.T @ white))

    @property
    def cost(self) -> float:
        """Of that residual [nats], the scale of the noise included."""
        return 0.5 * float(self.residual @ self.residual) + self.problem.log_scale()

    def off(self, changes: Sequence[Array]) -> tuple[Array, Array]:
        """Changes (k of samples,) whitened and off what retuning can do, (k, samples + size) in
        single precision, and along that (k, size).
        """
        q, size = self.slopes[0].astype(np.float32), self.problem.size
        left: Array = np.empty((len(changes), len(q)), dtype=np.float32)  # type: ignore[assignment]
        along = np.empty((len(changes), size))
        for n in range(0, len(changes), TOGETHER):
            part = slice(n, n + TOGETHER)
            rows = np.zeros((len(changes[part]), len(q)))
            rows[:, : len(q) - size] = changes[part]
            left[part] = self._whitened(rows)
            reach = left[part] @ q
            left[part] -= reach @ q.T
            along[part] = reach
        return left, along

    def left(self, taken: tuple[Array, Array, Array] | None = None) -> list[list[Array]]:
        """Errors of each channel of each run once retuning is fitted, and changes (k, samples) that
        are ``taken``: themselves, and what `off` tells of them.
        """
        error, (q, r) = self.fit.residual, self.slopes
        reach, count = q.T @ self._whitened(error[None])[0], len(error) - self.problem.size
        found = error[:count].copy()
        if taken is not None:
            changes, off, along = taken
            factors = np.linalg.lstsq(off.T.astype(float), self.residual, rcond=None)[0]
            found -= changes.T @ factors
            reach -= along.T @ factors
        found -= self.fit.jacobian[:count] @ np.linalg.lstsq(r, reach, rcond=SINGULAR)[0]
        return [[channel[0] for channel in run] for run in self._channels(found[None])]

    def _whitened(self, rows: Array) -> Array:
        """Rows (k, samples + size) through the noise; priors stay as they are."""
        found, at = np.empty(np.shape(rows)), 0
        for r, run in enumerate(self._channels(rows)):
            white = self.problem.whiten([np.ascontiguousarray(c) for c in run], r)
            found[:, at : (at := at + white.shape[1])] = white
        found[:, at:] = rows[:, at:]
        return found

    def _channels(self, rows: Array) -> list[list[Array]]:
        """Parts (k, m) of rows (k, ..), for each channel of each run."""
        counts = [[len(s.index) for s in run.samples] for run in self.fit.problem.runs]
        ends = np.cumsum([n for run in counts for n in run])
        parts = iter(np.split(rows, ends, axis=1))
        return [[next(parts) for _ in run] for run in counts]
