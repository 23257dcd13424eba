"""Which data kept back a free-form law speaks of: those where training reached its argument.

Beyond, the law keeps the values of its ends, which nobody claims.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.data.samples import FEWEST, Run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape, onsets
from corexy_fmi.engine.judging.prove import channel_noise
from corexy_fmi.kernel.call import Array

MARGIN = 0.02  # of the range that training reached
TRUE = {"x": "x_true", "y": "y_true"}  # what the kernel calls them


def within_reach(fit: Fit, kept: Sequence[Run]) -> list[Run]:
    """The runs kept back with those samples alone that a fit's laws speak of; without the channels
    and runs of which too few are left.  They are as they were where no law was fitted.
    """
    if not fit.problem.hypothesis.laws:
        return list(kept)
    seen = np.concatenate([_seen(fit, run) for run in fit.problem.runs], axis=1)
    low, high = seen.min(axis=1), seen.max(axis=1)
    margin = MARGIN * (high - low)
    cut = [_cut(fit, run, low - margin, high + margin) for run in kept]
    return [run for run in cut if run.samples]


def beyond_reach(kept: Sequence[Run], judged: Sequence[Run]) -> str:
    """In words how much of the data kept back is not judged; nothing where all is."""
    left, whole = (sum(run.count for run in runs) for runs in (judged, kept))
    if left == whole:
        return ""
    return (
        f"{1 - left / whole:.0%} of the data kept back say nothing of it: they lie where no data "
        "used have been"
    )


def _cut(fit: Fit, run: Run, low: Array, high: Array) -> Run:
    """A run without samples where an argument is outside low, high (laws,)."""
    told = _arguments(fit, run)
    outside = np.any((told < low[:, None]) | (told > high[:, None]), axis=0)
    if not outside.any():
        return run
    left = [s.without(outside[s.index]) for s in run.samples]
    return run.with_samples(tuple(s for s in left if len(s.index) > FEWEST))


def _seen(fit: Fit, run: Run) -> Array:
    """What its laws depend on, (laws, rows), up to the last sample that a fit used of a run."""
    last = max((s.index[-1] for s in run.samples if len(s.index)), default=-1)
    return _arguments(fit, run)[:, : last + 1]


def _arguments(fit: Fit, run: Run) -> Array:
    """What a fit's laws depend on, (laws, rows), over a run."""
    problem = fit.problem
    there = replace(problem, runs=(run,), noise=(channel_noise(problem.runs, problem.noise, run),))
    known = dict(zip(problem.keys, fit.u, strict=True))
    u = np.array([known.get(key, 0.0) for key in there.keys])
    names = [TRUE.get(law.argument, law.argument) for law in problem.hypothesis.laws]
    driven = tuple(name for name in names if name != "t")
    shown = iter(there.simulate(u[None], 0, driven)[0] if driven else ())
    given = [_time(fit, law, run) for law in problem.hypothesis.laws]
    return np.array(
        [t if name == "t" else next(shown) for name, t in zip(names, given, strict=True)]
    )


def _time(fit: Fit, law: LawShape, run: Run) -> Array:
    """The time (rows,) of a law in a run; where it has its own in each, by the onset that training
    told of that recording, or whenever it may begin in another.
    """
    time, names = run.excitation.time, [r.name for r in fit.problem.runs]
    if not law.since:
        return time
    return time - onsets(fit, law)[names.index(run.name)] if run.name in names else 0 * time
