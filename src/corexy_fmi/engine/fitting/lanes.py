"""Sets of one or of several problems, as the kernel runs them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corexy_fmi.kernel.call import Array


@dataclass(frozen=True, eq=False)
class Lanes:
    """Parameter vectors (sets, n), what they begin with (`REST`, and in motion `PUSH`), and how
    late [s] (sets,) a free clock shows them.
    """

    vectors: Array
    rest: Array
    push: Array | None
    delay: Array | None


def joined(parts: Sequence[Lanes]) -> Lanes:
    """The sets of several problems with the same runs."""
    vectors = np.concatenate([p.vectors for p in parts])
    rest = np.concatenate([p.rest for p in parts])
    return Lanes(vectors, rest, _all([p.push for p in parts]), _all([p.delay for p in parts]))


def _all(arrays: Sequence[Array | None]) -> Array | None:
    known = [a for a in arrays if a is not None]
    return np.concatenate(known) if known else None
