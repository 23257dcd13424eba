"""Both axes of one tracker have one noise: what is slow in one of them alone acts on that axis.

A force that comes irregularly leaves what no law of the motion holds, and its colour passes for
that of noise.  But a tracker does not know which way the stage moves: where x and y scatter alike
from sample to sample, they do so slowly, too.  Were it so, both axes would have as many independent
means; so many has the less coloured one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.noise import quick_noise
from corexy_fmi.engine.fitting.quiet import SURE, independent
from corexy_fmi.kernel.call import Array

PAIR = ("x", "y")
SLOW, FEWEST = 8, 20.0  # samples whose mean is slow; independent means that tell
ALIKE = 0.25  # of the other's, by which quick noise may differ in one tracker
LOUDER = (
    1.25  # ratio of slow to quick in one axis, over that of the other, that noise does not have
)


@dataclass(frozen=True)
class _Slow:
    """Slow over quick deviation of errors, 1 for white noise, and its independent values."""

    ratio: float
    count: float


def uneven(fit: Fit) -> tuple[str, str]:
    """An axis that errs slowly where the other does not, and words for it; empty where both are
    alike.

    Judged on all recordings of a fit together.
    """
    logs, weights = [], []
    for r, run in enumerate(fit.problem.runs):
        both = _both(run, [e[0] for e in fit.problem.errors(fit.u[None], r)])
        if both is not None:
            x, y = both
            logs.append(float(np.log(y.ratio / x.ratio)))
            weights.append(max(x.count, y.count))  # 1 / variance: 1 / (0.5 / n + 0.5 / n)
    total = sum(weights)
    if not total:
        return "", ""
    mean = float(np.dot(logs, weights)) / total
    if abs(mean) * np.sqrt(total) < SURE or np.exp(abs(mean)) < LOUDER:
        return "", ""
    one, other = PAIR[::-1] if mean > 0 else PAIR
    return one, (
        f"the mismatch of {one} is slow, {np.exp(abs(mean)):.1f} times as much as that of {other}: "
        f"something irregular acts along {one}, or on its sensor"
    )


def _both(run: Run, errors: Sequence[Array]) -> tuple[_Slow, _Slow] | None:
    """What x and y of a run show; None where their quick noise is not that of one tracker, or they
    are too short, or where one has none at all.
    """
    at = {s.channel: n for n, s in enumerate(run.samples)}
    if not all(name in at for name in PAIR):
        return None
    x, y = (at[name] for name in PAIR)
    one, other = (quick_noise(run.samples[n]) for n in (x, y))
    if max(one, other) > (1 + ALIKE) * min(one, other):
        return None
    first, second = (_slow(errors[n]) for n in (x, y))
    told = max(first.count, second.count) > FEWEST and min(first.ratio, second.ratio) > 0
    return (first, second) if told else None


def _slow(errors: Array) -> _Slow:
    """Of errors (m,): deviation of means over `SLOW` samples, and of the samples from those."""
    whole = len(errors) // SLOW
    if whole < FEWEST:
        return _Slow(1.0, 0.0)
    parts = (errors - errors.mean())[: whole * SLOW].reshape(whole, SLOW)
    means = parts.mean(axis=1)
    quick = float(np.std(parts - means[:, None])) / np.sqrt(1 - 1 / SLOW)
    return _Slow(float(np.std(means)) * np.sqrt(SLOW) / max(quick, 1e-300), independent(means))
