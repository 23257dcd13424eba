"""Sparse regression by pysindy, and the criterion that chooses among its settings.

Mangan, Kutz, Brunton, Proctor, Proc. R. Soc. A 473, 2017: sparse models by information criteria.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from benchmarks.rivals.common import Array

DEPENDENT = 1e-4  # share of a column that the ones before it do not hold
RIDGE = 1e-3  # of the nominal terms, columns of unit rms


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


def beside(theta: Array, lacking: Array, free: Array, setting: Setting) -> Array:
    """The same where the nominal model's own terms, ``free`` (candidates,), are refitted too.

    They are partialled out of all others, lightly ridged; else what retuning has hidden stays so.
    """
    if not setting.rank:
        return sparse(theta, lacking, setting)
    scale = np.sqrt(np.mean(theta**2, axis=0)) + 1e-12
    own, rest = (theta / scale)[:, free], (theta / scale)[:, ~free]
    normal = own.T @ own + RIDGE * len(own) * np.eye(own.shape[1])
    share = np.linalg.solve(normal, own.T @ np.column_stack([rest, lacking]))
    of_rest, of_lacking = share[:, : rest.shape[1]], share[:, rest.shape[1] :]
    terms = sparse(rest - own @ of_rest, lacking - own @ of_lacking, setting)
    found = np.zeros((lacking.shape[1], theta.shape[1]))
    found[:, ~free], found[:, free] = terms, (of_lacking - of_rest @ terms.T).T
    return found / scale


def criterion(rms: float, samples: int, found: Array) -> float:
    """Bayes' information criterion of a correction that leaves an rms [m] of samples."""
    return samples * float(np.log(rms**2)) + np.count_nonzero(found) * float(np.log(samples))
