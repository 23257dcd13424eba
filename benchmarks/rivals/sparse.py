"""Sparse regression by pysindy, and which of its settings cross-validation chooses."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.rivals.common import Array

DEPENDENT = 1e-4  # share of a column that the ones before it do not hold
AS_GOOD = 1.01  # times the best score: among these the plainest is taken


@dataclass(frozen=True, order=True)
class Setting:
    """``rank`` orders by plainness; a greedy search for ``terms``, or a ``threshold`` of a term,
    columns and target of unit rms; neither: no term at all.
    """

    rank: int
    terms: int = 0
    threshold: float = 0.0

    def __str__(self) -> str:
        if self.terms:
            return f"FROLS, {self.terms} term{'s' * (self.terms > 1)}"
        return f"STLSQ, threshold {self.threshold:g}" if self.threshold else "no term"


SETTINGS = (
    Setting(0),
    *(Setting(k, terms=k) for k in (1, 2, 4)),
    *(Setting(5 + k, threshold=t) for k, t in enumerate((0.4, 0.1))),
)


def independent(theta: Array) -> Array:
    """Which columns of unit rms say more than those before them; FROLS breaks down on others."""
    around = np.abs(np.diag(np.linalg.qr(theta, mode="r")))
    return np.flatnonzero(around > DEPENDENT * np.sqrt(len(theta)))


def sparse(theta: Array, lacking: Array, setting: Setting) -> Array:
    """Terms (m, candidates) of what lacks (n, m), over candidates (n, candidates)."""
    found = np.zeros((lacking.shape[1], theta.shape[1]))
    if not setting.rank:
        return found
    import pysindy

    scale, size = np.sqrt(np.mean(theta**2, axis=0)) + 1e-12, np.sqrt(np.mean(lacking**2)) + 1e-12
    used = independent(theta / scale)
    if setting.terms:
        optimizer = pysindy.FROLS(max_iter=min(setting.terms, len(used)), alpha=1e-3)
    else:
        optimizer = pysindy.STLSQ(threshold=setting.threshold, alpha=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a threshold leaves no term is an answer
        optimizer.fit((theta / scale)[:, used], lacking / size)
    found[:, used] = np.asarray(optimizer.coef_) * size / scale[used]
    return found


def plainest(tried: Mapping[Any, float]) -> Any:
    """The key whose last item, a setting, is the plainest of those about as good as the best."""
    good = [key for key, score in tried.items() if score <= AS_GOOD * min(tried.values())]
    return min(good, key=lambda key: (key[-1].rank, tried[key]))
