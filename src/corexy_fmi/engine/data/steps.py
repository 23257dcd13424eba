"""Steps that a sensor rounds to, and what of an encoder's counts is told twice."""

from __future__ import annotations

import numpy as np

from corexy_fmi.kernel.call import Array

LAST = 1e-12  # of a channel's largest value: less is no step, but the last bits of whole counts
WHOLE = 0.01  # of a step, by which a value may miss a whole number of them


def least_step(values: Array) -> float:
    """The least difference of two values, last bits aside; 0 where all are one."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > LAST * np.abs(values).max(initial=0.0)]
    return float(steps.min()) if len(steps) else 0.0


def sensor_step(values: Array) -> float:
    """The step that all values are whole numbers of, in their unit; 0 without one."""
    step = least_step(values)
    if not step:
        return 0.0
    counts = (values - values[0]) / step
    return step if np.abs(counts - np.rint(counts)).max() < WHOLE else 0.0


def told_before(values: Array) -> np.ndarray:
    """True (m,) for all samples but the middle one of each stretch of one count; False everywhere
    for values (m,) that are no counts.

    While a count stands, the error of rounding does, too: a second of rest at 1 kHz would be a
    thousand witnesses of where in a count a motor came to rest.  In the middle of a count's time an
    axis in motion is near the middle of the count.
    """
    repeated = np.zeros(len(values), dtype=bool)
    if not sensor_step(values):
        return repeated
    begins = np.flatnonzero(np.diff(values, prepend=np.nan))
    ends = np.r_[begins[1:], len(values)]
    repeated[:] = True
    repeated[(begins + ends - 1) // 2] = False
    return repeated
