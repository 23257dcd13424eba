"""Spikes: single samples far off the course of both sides are treated as not taken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from corexy_fmi.engine.data.samples import Run, Samples
from corexy_fmi.engine.data.steps import least_step
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.kernel.call import Array

FAR = 6.0  # robust standard deviations of a sample against the mean of its neighbours
OFF = 0.5  # share of that by which it is off the course of either side
ON = 2.5  # distances of two samples for which their line goes on
STARK = 10.0  # times that, beyond which two of a place are no peak: nothing gets there and back
ROUNDING = 2.0  # steps of a sensor within which neighbours may be rounded apart
MATES = (  # how far two spikes are apart, and the samples around the later and the earlier one
    (1, (-3, -2, 1, 2), (-2, -1, 2, 3)),
    (2, (-3, -1, 1, 2), (-2, -1, 1, 3)),
)
BEYOND, NEAR = 2, 5  # samples thought behind an end; of which they have the median
LOCAL = 16  # samples whose spread counts at an end, where it is larger
PLACES = ("x", "y")
MANY = 0.02  # share of samples above which they are no spikes


def spikes(errors: Array, time: Array, step: float = 0.0, stark: float = np.inf) -> np.ndarray:
    """True (m,) where an error stands alone: far off the line between its neighbours, and off the
    course of both sides, all by the samples' time (m,); or where two do so without each other, one
    sample apart, or side by side on either side of the course, or on one side ``stark`` times as
    far off as one alone need be.  A step, a kink or a peak of several samples is physics.  What is
    within two ``step`` of the sensor may be its rounding.  Beyond both ends the course is thought
    to go on as the median of the last few samples.
    """
    if len(errors) < 5:
        return np.zeros(len(errors), dtype=bool)
    inner = np.arange(1, len(errors) - 1)
    off = errors[inner] - _line(errors, time, inner - 1, inner + 1, inner)
    if not _spread(off) > 0:
        return np.zeros(len(errors), dtype=bool)
    least = np.full(len(errors) + 2 * BEYOND, _spread(off))
    for end, part in ((slice(2 * BEYOND), off[:LOCAL]), (slice(-2 * BEYOND, None), off[-LOCAL:])):
        least[end] = max(_spread(off), _spread(part))
    found = _standing(*_continued(errors, time), np.maximum(FAR * least, ROUNDING * step), stark)
    return found[BEYOND:-BEYOND]


def _spread(off: Array) -> float:
    """Robust standard deviation of values around zero."""
    return float(np.median(np.abs(off))) / 0.6745


def _continued(errors: Array, time: Array) -> tuple[Array, Array]:
    """Errors and time with samples before and behind, on a level with the median near."""
    first, last = (np.full(BEYOND, np.median(part)) for part in (errors[:NEAR], errors[-NEAR:]))
    ahead = np.median(np.diff(time)) * np.arange(1, BEYOND + 1)
    return (
        np.concatenate([first, errors, last]),
        np.concatenate([time[0] - ahead[::-1], time, time[-1] + ahead]),
    )


def _standing(errors: Array, time: Array, least: Array, stark: float) -> np.ndarray:
    """True (m,) where an error stands alone, or two do, by more than ``least`` (m,)."""
    found = _alone(errors, time, (-2, -1, 1, 2), least) != 0
    for apart, late, early in MATES:
        later, earlier = (_alone(errors, time, around, least) for around in (late, early))
        both = later[apart:] * earlier[:-apart]
        size = np.minimum(np.abs(later[apart:]), np.abs(earlier[:-apart]))
        alike = (both > 0) & (size > stark * least[:-apart])
        first = np.flatnonzero((both != 0) if apart > 1 else (both < 0) | alike)
        found[first + 1] = False  # what lies between two of one side looks like one
        found[first] = found[first + apart] = True
    return found


def _alone(errors: Array, time: Array, around: Sequence[int], least: Array) -> Array:
    """How far (m,) an error that stands alone is off the line between its neighbours, 0 where none
    does, given where the two samples on either side are.  Two samples foretell less of a third
    than its neighbours do, so less is asked of those.
    """
    places = np.arange(-around[0], len(errors) - around[-1])
    before, left, right, after = (places + k for k in around)
    off = np.array(
        [
            errors[places] - _line(errors, time, a, b, places)
            for a, b in ((left, right), (before, left), (right, after))
        ]
    )
    far = np.abs(off[0])
    alone = far > least[places]
    for a, b, at in ((before, places, left), (places, after, right)):  # a spike draws these, too
        alone &= far >= np.abs(errors[at] - _line(errors, time, a, b, at))
    alone &= np.abs(off[1:]).min(axis=0) > OFF * far
    alone &= np.abs(np.sign(off).sum(axis=0)) == len(off)
    found = np.zeros(len(errors))
    found[places] = alone * off[0]
    return found


def _line(errors: Array, time: Array, a: np.ndarray, b: np.ndarray, at: np.ndarray) -> Array:
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
            far = STARK if samples.channel in PLACES else np.inf
            time = run.excitation.time[samples.index]
            bad = spikes(e[0], time, least_step(samples.value), far)
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
