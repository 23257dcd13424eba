"""Offer: the linear responses of a place, or of two places and of both at once, through a view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.places.responses import Response
from corexy_fmi.engine.places.view import View
from corexy_fmi.kernel.call import Array

CANCELS = 1e-3  # share of the parts' size below which their sum is rounding in single precision


@dataclass(frozen=True, eq=False)
class Offer:
    """Responses of a place, and what they are through a view: `View.off`.

    Of two places it offers, behind the responses of both, each law at both at once: what it does at
    the one plus ``signs`` times what it does at the other, formed only where it is asked for.
    """

    parts: tuple[tuple[Response, ...], ...]
    off: tuple[Array, ...]  # (k, samples + size) of each part, in single precision
    along: tuple[Array, ...]  # (k, size) of each part
    place: str = ""
    signs: tuple[float, ...] = ()

    @staticmethod
    def of(responses: Sequence[Response], view: View) -> Offer:
        """The responses through a view."""
        off, along = view.off([r.change for r in responses])
        return Offer((tuple(responses),), (off,), (along,))

    def beside(self, other: Offer, place: str, signs: Sequence[float]) -> Offer:
        """Those of two places, and each law at both of them at once, alike or with other signs."""
        if len(self) != len(other):
            raise ValueError(f"{len(self)} responses beside {len(other)}")
        off, along = self.off + other.off, self.along + other.along
        return Offer(self.parts + other.parts, off, along, place, tuple(signs))

    def __len__(self) -> int:
        return len(self.parts[0]) * (len(self.parts) + len(self.signs))

    def chosen(self) -> Array:
        """What it costs [nats] that the data themselves chose each response (len,)."""
        own = [np.array([r.chosen for r in part]) for part in self.parts]
        return np.concatenate([*own, *(own[0] for _ in self.signs)])

    def times(self, column: Array) -> Array:
        """Products (len,) of the responses with a column (samples + size,)."""
        single = column.astype(np.float32)
        own = [part @ single for part in self.off]
        return np.concatenate([*own, *(own[0] + np.float32(s) * own[1] for s in self.signs)])

    def powers(self) -> Array:
        """Squares (len,) of the responses; 0 where two all but cancel, for `times` tells no more of
        them than rounding.
        """
        found = np.array([row @ row for row in map(self.row, range(len(self)))], dtype=float)
        own = found[: len(self.parts[0]) * len(self.parts)].reshape(len(self.parts), -1).sum(axis=0)
        tied = found.reshape(-1, len(own))[len(self.parts) :]
        tied[tied < CANCELS**2 * own] = 0.0
        return found

    def row(self, k: int) -> Array:
        """The k-th response through the view, off what retuning can do (samples + size,)."""
        return self._formed(self.off, k)

    def reach(self, k: int) -> Array:
        """What of the k-th response retuning can do (size,)."""
        return self._formed(self.along, k)

    def response(self, k: int) -> Response:
        """The k-th response as it was before the view."""
        first, *second = self._terms(k)
        found = self.parts[first[0]][first[1]]
        if not second:
            return found
        changes = [[r.change for r in part] for part in self.parts]
        return replace(found, location=self.place, change=self._formed(changes, k))

    def _formed(self, parts: Sequence[Array | Sequence[Array]], k: int) -> Array:
        (part, row, _), *second = self._terms(k)
        found = parts[part][row]
        for part, row, sign in second:
            found = found + found.dtype.type(sign) * parts[part][row]
        return found

    def _terms(self, k: int) -> list[tuple[int, int, float]]:
        """Part, row and sign of what makes the k-th response."""
        block, row = divmod(int(k), len(self.parts[0]))
        if block < len(self.parts):
            return [(block, row, 1.0)]
        return [(0, row, 1.0), (1, row, self.signs[block - len(self.parts)])]
