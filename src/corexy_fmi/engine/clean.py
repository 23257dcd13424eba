"""Spikes: single samples far off the course of both sides are treated as not taken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.noise import least_step
from corexy_fmi.engine.samples import Run, Samples
from corexy_fmi.kernel.call import Array

FAR = 6.0  # robust standard deviations of a sample against the mean of its neighbours
OFF = 0.5  # share of that by which it is off the course of either side
ON = 2.5  # distances of two samples for which their line goes on
ROUNDING = 2.0  # steps of a sensor within which neighbours may be rounded apart
MANY = 0.02  # share of samples above which they are no spikes


def spikes(errors: Array, time: Array, step: float = 0.0) -> np.ndarray:
    """True (m,) where an error stands alone: far off the line between its neighbours, and off the
    course of both sides, all by the samples' time (m,).  A step, a kink or a peak of several
    samples is physics.  Two samples foretell less of a third than its neighbours do, so less is
    asked of those.  What is within two ``step`` of the sensor may be its rounding.
    """
    found = np.zeros(len(errors), dtype=bool)
    if len(errors) < 5:
        return found
    before, left, here, right, after = (slice(k, len(errors) - 4 + k) for k in range(5))
    off = np.array(
        [
            errors[here] - _line(errors, time, a, b, here)
            for a, b in ((left, right), (before, left), (right, after))
        ]
    )
    spread = float(np.median(np.abs(off[0]))) / 0.6745
    far = np.abs(off[0])
    beside = np.pad(far, 1)  # a spike draws the mean of its neighbours' neighbours, too
    alone = far >= np.maximum(beside[:-2], beside[2:])
    alone &= far > max(FAR * spread, ROUNDING * step)
    alone &= np.abs(off[1:]).min(axis=0) > OFF * far
    alone &= np.abs(np.sign(off).sum(axis=0)) == len(off)
    found[2:-2] = alone & (spread > 0)
    return found


def _line(errors: Array, time: Array, a: slice, b: slice, at: slice) -> Array:
    """The straight line through the samples a and b, where the samples ``at`` are; it goes on for
    no more than ``ON`` times their distance, for behind a long gap a course tells little.
    """
    share = np.clip((time[at] - time[a]) / (time[b] - time[a]), -ON, 1 + ON)
    return np.asarray(errors[a] + share * (errors[b] - errors[a]))


def without_spikes(fit: Fit) -> tuple[Run, ...]:
    """The fit's runs, spikes left out where they are few."""
    runs = []
    for r, run in enumerate(fit.problem.runs):
        errors = fit.problem.errors(fit.u[None], r)
        kept: list[Samples] = []
        for samples, e in zip(run.samples, errors, strict=True):
            bad = spikes(e[0], run.excitation.time[samples.index], least_step(samples))
            kept.append(samples.without(bad) if 0 < bad.mean() <= MANY else samples)
        runs.append(run.with_samples(tuple(kept)))
    return tuple(runs)


def told(given: Sequence[Run], used: Sequence[Run]) -> list[Finding]:
    """What is to be said of the samples of each channel that were left out as spikes."""
    pairs = (
        (run.name, s, len(s.index) - len(kept.index))
        for run, clean in zip(given, used, strict=True)
        for s, kept in zip(run.samples, clean.samples, strict=True)
    )
    fix = "Look at the sensor's cable and its target; a few do no harm."
    return [
        Finding(
            f"{name}: {count} of {len(s.index)} samples of {s.channel} stand alone, "
            "far off their neighbours, and were left out",
            fix,
        )
        for name, s, count in pairs
        if count
    ]
