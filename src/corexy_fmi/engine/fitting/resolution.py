"""Resolution: what is no more than a sensor's rounding is nothing that can be told.

A sensor that rounds to steps errs by up to half of one, and how it does follows the motion: at a
steady speed whose rows are whole steps apart, hundreds of samples err alike.  No model of noise
knows that, and laws of the motion take it up.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.data.samples import Samples
from corexy_fmi.engine.data.steps import sensor_step
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.kernel.call import Array

ROOM = 1.1  # of a step over sqrt(12), up to which errors are no more than rounding
STANDS = 1.3  # the same where all are within `WHOLE_RANGE`: an axis that stands errs alike for long
WHOLE_RANGE = 1.3  # of a step


def at_resolution(fit: Fit) -> bool:
    """Whether every channel of a fit errs no more than it is rounded."""
    pairs = (
        (samples, errors[0])
        for r, run in enumerate(fit.problem.runs)
        for samples, errors in zip(run.samples, fit.problem.errors(fit.u[None], r), strict=True)
    )
    return all(_is_rounding(samples, errors) for samples, errors in pairs)


def _is_rounding(samples: Samples, errors: Array) -> bool:
    """Whether errors (m,) of a channel are no more than its rounding."""
    step = sensor_step(samples.value)
    room = STANDS if float(np.ptp(errors)) <= WHOLE_RANGE * step else ROOM
    return step > 0 and float(np.std(errors)) <= room * step / np.sqrt(12)


def told(retuned: Fit) -> list[Finding]:
    """What is to be said where the retuned machine leaves no more than rounding."""
    if not at_resolution(retuned):
        return []
    steps = {s.channel: sensor_step(s.value) for run in retuned.problem.runs for s in run.samples}
    listed = ", ".join(f"{name} in steps of {step:.3g}" for name, step in sorted(steps.items()))
    text = f"what is left is no more than the sensors round ({listed}, SI units)"
    return [Finding(text, "to see anything smaller, record with a finer sensor")]
