"""Simulated rows of a channel into whitened errors: compiled, or by `Noise.whiten` where it is not.

A fit spends as long on this as on its simulations; so every row is read and written once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from corexy_fmi.engine.data.samples import Samples
from corexy_fmi.engine.fitting.noise import Noise, warm_up
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.whiten import Whitening


@dataclass(frozen=True, eq=False)
class Filter:
    """The noise of a channel's samples, and whether a constant offset is projected out."""

    noise: Noise
    samples: Samples
    free: bool

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.samples.index)

    @cached_property
    def offset(self) -> Array | None:
        """A constant, whitened (m,) and of unit length; None where the channel's zero is known."""
        if not self.free:
            return None
        one = self.noise.whiten(np.ones(self.count), self.samples.breaks)
        return np.asarray(one / np.linalg.norm(one))

    @cached_property
    def _of_rows(self) -> Whitening:
        return self._compiled(self.samples.rows, self.samples.value)

    @cached_property
    def _of_errors(self) -> Whitening:
        return self._compiled(slice(0, self.count), None)

    def _compiled(self, rows: np.ndarray | slice, value: Array | None) -> Whitening:
        n = self.noise
        starts = np.flatnonzero(warm_up(self.samples.breaks, len(n.coefficients)))
        return Whitening(rows, value, starts, n.coefficients, n.innovation, n.marginal, self.offset)

    def rows(self, simulated: Array, white: Sequence[Array]) -> None:
        """Measured minus simulated rows (sets, n), whitened, into arrays (m,), one for each set."""
        if not self._of_rows.into(simulated, white):
            self._slowly(self.samples.value - simulated[:, self.samples.rows], white)

    def white(self, errors: Array) -> Array:
        """Errors (sets, m), whitened."""
        if errors.strides[-1] != errors.itemsize:  # picked rows may lie the other way round
            errors = np.ascontiguousarray(errors)
        result = np.empty(errors.shape)
        if not self._of_errors.into(errors, list(result)):
            self._slowly(errors, list(result))
        return result

    def _slowly(self, errors: Array, white: Sequence[Array]) -> None:
        found = self.noise.whiten(errors, self.samples.breaks)
        with np.errstate(over="ignore", invalid="ignore"):  # runs that broke down
            if self.offset is not None:
                found -= (found @ self.offset)[:, None] * self.offset
        for one, into in zip(found, white, strict=True):
            into[:] = one
