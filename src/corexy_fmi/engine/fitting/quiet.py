"""Noise is the same in every recording of a channel, the same at rest as in motion, and forgets.

A slow mismatch can pass for coloured noise in a recording's own statistics, and is then invisible:
the model that hides it is as good as true.  Where the same channel is much quieter in another
recording, at rest, or in the differences of the motion's loops, that quieter noise is the noise.
What is still alike after a second is none: a jump in one recording would make a noise of it whose
one surprise is the jump.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from corexy_fmi.engine.data.loops import looped_rows
from corexy_fmi.engine.data.samples import Run, Samples, even
from corexy_fmi.engine.data.steps import least_step
from corexy_fmi.engine.fitting.jitter import scatter
from corexy_fmi.engine.fitting.noise import Noise, difference_noise, estimate, finest
from corexy_fmi.kernel.call import Array

QUIET = 0.3  # [s] without a change of the inputs, after which the stage rests
ROWS, FEWEST = 60, 8.0  # samples, and independent ones, that tell a standard deviation
SEVERAL = 4.0  # independent samples of a rest, by what motion shows, from which on they count so
LOUDER = 1.5  # ratio of standard deviations, in motion to at rest, that noise does not have
APART = 1.15  # the same of two recordings, of their noise or of what is new in each sample
COARSE = 1.0  # of a sensor's step, below which errors are coloured by how the motion meets it
SURE = 4.0  # standard errors of the logarithm of a ratio, or of a correlation
MEMORY, ALIKE = 1.0, 0.3  # [s] after which noise has forgotten; correlation that it has not, then


def at_rest(run: Run) -> np.ndarray:
    """Rows (n,) whose inputs stood still for a while; none where voltages are the inputs."""
    e = run.excitation
    if e.mode == "voltages":
        return np.zeros(len(e.time), dtype=bool)
    moved = (np.diff(e.input1, prepend=np.nan) != 0) | (np.diff(e.input2, prepend=np.nan) != 0)
    last = np.maximum.accumulate(np.where(moved, e.time, -np.inf))
    return np.asarray(e.time - last > QUIET)


def independent(errors: Array) -> float:
    """How many independent samples tell as much about the variance (Bartlett).

    No mean is removed: in a short rest, slow noise is little but mean, and counts as one sample.
    """
    spectrum = np.abs(np.fft.rfft(errors, 2 * len(errors))) ** 2
    correlation = np.fft.irfft(spectrum)[: max(len(errors) // 4, 1)]
    correlation /= max(correlation[0], 1e-300)
    return len(errors) / max(float(2 * np.sum(correlation**2) - 1), 1.0)  # less: all are 0


def lasting(errors: Array, time: Array) -> bool:
    """Whether errors (m,) at time (m,) [s] are alike after a second, more than short noise is."""
    value, spacing = even(errors, time)
    lag = max(round(MEMORY / spacing), 1)
    if len(value) < 2 * lag:
        return False
    alike = float(value[lag:] @ value[:-lag] / max(float(value @ value), 1e-300))
    return alike > ALIKE and alike * np.sqrt(independent(quick_part(errors, time))) > SURE


def quick_part(errors: Array, time: Array) -> Array:
    """Errors (m,) without their mean over a second around each."""
    count = max(round(MEMORY / float(np.median(np.diff(time)))), 1)
    return np.asarray(errors - uniform_filter1d(errors, count, mode="nearest"))


def significance(ratio: float, one: float, other: float) -> float:
    """Standard errors of the logarithm of a ratio of standard deviations of so many samples."""
    return float(np.log(max(ratio, 1e-9)) / np.sqrt(0.5 / one + 0.5 / other))


def own_models(runs: tuple[Run, ...], errors: list[list[Array]]) -> tuple[tuple[Noise, ...], ...]:
    """The noise of each channel of each run, as its errors (m,) and those of others show it."""
    late = [
        [scatter(run, s, e) for s, e in zip(run.samples, mine, strict=True)]
        for run, mine in zip(runs, errors, strict=True)
    ]
    found = [
        [_of_run(run, s, e, v) for s, e, v in zip(run.samples, mine, jitter, strict=True)]
        for run, mine, jitter in zip(runs, errors, late, strict=True)
    ]
    sizes = [[independent(e - e.mean()) for e in mine] for mine in errors]
    for r, run in enumerate(runs):
        for c, samples in enumerate(run.samples):
            for q, k in _same(runs, samples.channel):
                known = float(late[r][c].mean() - late[q][k].mean())
                ratio = left(found[r][c].marginal, known) / found[q][k].marginal
                alike = sizes[q][k] * len(errors[r][c]) / len(errors[q][k])  # were it the same
                new = surprise(found[q][k], errors[r][c], samples, known)
                counts = len(errors[r][c]), len(errors[q][k])
                if louder(ratio, alike, sizes[q][k]) or louder(new, *counts):
                    found[r][c] = found[q][k]
    return tuple(map(tuple, found))


def louder(ratio: float, one: float, other: float) -> bool:
    """Whether a ratio of standard deviations of so many samples each parts two noises."""
    return ratio > APART and significance(ratio, one, other) > SURE


def surprise(noise: Noise, errors: Array, samples: Samples, known: float) -> float:
    """Standard deviation of a channel's errors (m,) whitened by another recording's noise, without
    what jitter adds (its mean square: ``known``): of two coloured noises it tells far more than
    their size, as each sample is a new one.  1 where the sensor's rounding may be what differs.
    """
    if float(np.std(errors)) < COARSE * least_step(samples.value):
        return 1.0
    white = noise.whiten(errors - errors.mean(), samples.breaks)
    gain = (1 + float(np.sum(noise.coefficients**2))) / noise.innovation**2
    return left(float(np.std(white)), known * gain)


def left(deviation: float, known: float) -> float:
    """A standard deviation without what jitter adds to its square."""
    return float(np.sqrt(max(deviation**2 - max(known, 0.0), 0.0)))


def _same(runs: tuple[Run, ...], channel: str) -> list[tuple[int, int]]:
    """Where a channel stands, by run and place, if it has samples enough to tell."""
    return [
        (r, c)
        for r, run in enumerate(runs)
        for c, s in enumerate(run.samples)
        if s.channel == channel and len(s.index) >= ROWS
    ]


def _of_run(run: Run, samples: Samples, errors: Array, late: Array) -> Noise:
    """The noise of one channel's errors, without what lasts; of those at rest, where they are far
    smaller; with the least that counts as noise.
    """
    floor = finest(samples)
    time = run.excitation.time[samples.index]
    quick = quick_part(errors, time) if lasting(errors, time) else errors
    looped = _of_loops(run, samples, errors)
    if looped is not None:
        return looped
    whole, rest = estimate(quick, samples.breaks, floor), at_rest(run)[samples.index]
    if min(rest.sum(), (~rest).sum()) < ROWS:
        return whole
    moving, still = errors[~rest] - errors.mean(), errors[rest] - errors.mean()
    sizes = independent(moving), independent(still)
    alike = sizes[0] * len(still) / len(moving)  # in the rest, were its noise that in motion
    if alike > SEVERAL:
        sizes = sizes[0], min(sizes[1], alike)
    loud = left(float(np.std(moving)), float(late[~rest].mean()))
    ratio = loud / max(float(np.sqrt(np.mean(still**2))), 1e-300)
    if min(sizes) < FEWEST or ratio < LOUDER or significance(ratio, *sizes) < SURE:
        return whole
    quiet = samples.without(~rest)
    return estimate(errors[rest], quiet.breaks, floor)


def _of_loops(run: Run, samples: Samples, errors: Array) -> Noise | None:
    """The noise that loops of the motion show, which no mismatch that comes back can colour; None
    without enough of them, or where they drift apart: then it is more than noise.
    """
    loops = run.loops
    time = run.excitation.time[samples.index]
    near = looped_rows(time, loops) if loops else None
    if near is None or near[1:].size < ROWS:
        return None
    noise, differences = difference_noise(errors[near], finest(samples))
    drifts = noise.marginal > APART * float(np.std(errors))
    return None if drifts or independent(differences) < FEWEST else noise
