"""Is a wave a wave?  What goes at a fixed frequency keeps its size and phase while it is recorded.

A force at random instants is partly met by the best wave of each recording, whose size and phase
then differ from one part of it to the next.  They are let go in every part, to first order, and
judged as what a fit leaves to simple functions is (`specification.py`).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.naming.specification import NOTHING, Leftover, judged

PARTS = 8  # of each recording


def unsteady(fit: Fit) -> Leftover:
    """What waves of a settled fit would gain, were they other ones in every part of a recording."""
    waves = _waves(fit)
    if not waves or not np.isfinite(fit.cost):
        return NOTHING
    own, _ = np.linalg.qr(fit.jacobian)
    normals, reaches, pulls, names = [], [], [], []
    for run, rows in _parts(fit):
        moved = fit.jacobian[rows][:, waves].T
        normals.append(moved @ moved.T)
        reaches.append(moved @ own[rows])
        pulls.append(moved @ fit.residual[rows])
        names += [("", f"{fit.problem.keys[k]} in {run}") for k in waves]
    normal, reach = np.zeros((len(names),) * 2), np.concatenate(reaches)
    for n, block in enumerate(normals):
        at = slice(n * len(waves), (n + 1) * len(waves))
        normal[at, at] = block
    pull = np.concatenate(pulls) - reach @ (own.T @ fit.residual)
    return judged(normal - reach @ reach.T, pull, np.diag(normal) + 1e-300, names)


def _waves(fit: Fit) -> list[int]:
    """Indices of the sizes and phases of what goes at a frequency of its own in time."""
    keys = fit.problem.keys
    return [
        k
        for i in fit.problem.hypothesis.uses
        if any(p.over == "frequency" for p in i.effect.parameters)
        for p in i.effect.parameters
        if p.size or (p.periodic and p.local)
        for k, key in enumerate(keys)
        if key.partition("@")[0] == f"{i.effect.name}.{i.location}.{p.name}"
    ]


def _parts(fit: Fit) -> list[tuple[str, np.ndarray]]:
    """Rows of the residual in each of `PARTS` parts of each recording, of all its channels."""
    found = []
    for run, part, filters in zip(
        fit.problem.runs, fit.problem.parts, fit.problem.filters, strict=True
    ):
        ends = part.start + np.cumsum([0, *(f.count for f in filters)])
        channels = [np.array_split(np.arange(a, b), PARTS) for a, b in pairwise(ends)]
        found += [(run.name, np.concatenate(rows)) for rows in zip(*channels, strict=True)]
    return found
