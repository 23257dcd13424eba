"""Samples stamped too early or too late scatter by the speed: noise that grows with the motion.

Such scatter has no memory, other than most of what a model leaves out, and its variance is
tau^2 v^2 with the stamps' deviation tau [s].  Third differences hide what is smooth, so that their
mean squares against v^2 show both tau and whether that is all that grows.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.data.samples import Run, Samples
from corexy_fmi.kernel.call import Array

WEIGHTS = np.array([1.0, 9.0, 9.0, 1.0])  # squares of a third difference's coefficients, of sum 20
GROUPS, FEWEST = 8, 50  # of differences, by speed; differences in each
OFF = 0.25  # share by which a group's mean square may miss the line, or by its own scatter
SIGMAS = 3.0
SCATTER = 2.33  # of the median of squares of normal numbers, over it, for one of them
MEDIAN = 0.4549  # of the square of a standard normal number
MEMORY = 3  # differences that hang together


def scatter(run: Run, samples: Samples, errors: Array) -> Array:
    """Variance (m,) that jitter gives each of a channel's errors (m,); zero where nothing shows
    that this is what grows with the speed.
    """
    time = run.excitation.time[samples.index]
    speed = np.gradient(samples.value - errors, time) ** 2 if len(time) > 1 else np.zeros(len(time))
    joined = ~(samples.breaks[1:-2] | samples.breaks[2:-1] | samples.breaks[3:])
    if joined.sum() < GROUPS * FEWEST:
        return np.zeros(len(errors))
    course = np.convolve(speed, WEIGHTS / WEIGHTS.sum(), "valid")[joined]
    squares = np.diff(errors, 3)[joined] ** 2 / WEIGHTS.sum()
    return speed * _squared_deviation(course, squares)


def _squared_deviation(speed: Array, squares: Array) -> float:
    """tau^2 [s^2] of differences by squared speed, from a line through the groups' medians."""
    groups = np.array_split(np.argsort(speed, kind="stable"), GROUPS)
    x = np.array([speed[g].mean() for g in groups])
    y = np.array([np.median(squares[g]) for g in groups]) / MEDIAN
    if np.ptp(x) <= 0 or y.min() <= 0:
        return 0.0
    most = float(x.max())
    (slope, level), *_ = np.linalg.lstsq(np.column_stack([x / most / y, 1 / y]), np.ones(len(y)))
    slope /= most
    line = level + slope * x
    off = max(OFF, SIGMAS * SCATTER * float(np.sqrt(MEMORY / len(groups[0]))))
    straight = level > 0 and slope > 0 and (np.abs(y - line) < off * line).all()
    return float(slope) if straight else 0.0
