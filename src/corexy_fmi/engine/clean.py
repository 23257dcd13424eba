"""Spikes: single samples far off the course of both sides are treated as not taken."""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.samples import Run, Samples
from corexy_fmi.kernel.call import Array

FAR = 6.0  # robust standard deviations of a sample against the mean of its neighbours
MANY = 0.02  # share of samples above which they are no spikes


def spikes(errors: Array, breaks: np.ndarray) -> np.ndarray:
    """True (m,) where an error stands alone: far off its neighbours' mean, and off the course of
    both sides.  A step, a kink or a peak of several samples is physics; beside a break (m,) nobody
    can tell.
    """
    found = np.zeros(len(errors), dtype=bool)
    if len(errors) < 5:
        return found
    e = errors[2:-2]
    off = np.array(
        [
            e - (errors[1:-3] + errors[3:-1]) / 2,
            e - (2 * errors[1:-3] - errors[:-4]),
            e - (2 * errors[3:-1] - errors[4:]),
        ]
    )
    spread = float(np.median(np.abs(off[0]))) / 0.6745
    alone = np.abs(off).min(axis=0) > FAR * spread
    alone &= np.abs(np.sign(off).sum(axis=0)) == len(off)
    torn = breaks[1:-3] | breaks[2:-2] | breaks[3:-1] | breaks[4:]
    found[2:-2] = alone & ~torn & (spread > 0)
    return found


def without_spikes(fit: Fit) -> tuple[Run, ...]:
    """The fit's runs, spikes left out where they are few."""
    runs = []
    for r, run in enumerate(fit.problem.runs):
        errors = fit.problem.errors(fit.u[None], r)
        kept: list[Samples] = []
        for samples, e in zip(run.samples, errors, strict=True):
            bad = spikes(e[0], samples.breaks)
            kept.append(samples.without(bad) if 0 < bad.mean() <= MANY else samples)
        runs.append(run.with_samples(tuple(kept)))
    return tuple(runs)
