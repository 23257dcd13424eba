"""Tones of what a fit leaves: where in the spectrum something periodic may be."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from corexy_fmi.engine.data.samples import even
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.kernel.call import Array

TONES, LOCAL = 6, 3  # the strongest, and more of those that stand out of what is around them
FINER = 4  # zero padding of the spectrum
AROUND = 64  # width [1/length of a recording] of the spectrum that a peak is compared with
SAME = 0.02  # share of a frequency within which two are one
Peak = tuple[float, float]  # power, frequency [Hz]


def tones(fit: Fit) -> tuple[float, ...]:
    """The strongest frequencies [Hz] of the residuals, strongest first, then those that stand out
    most of the spectrum around them: beside slow noise a tone of 29 Hz is none of the strongest.
    """
    spectra = []
    for r, run in enumerate(fit.problem.runs):
        errors = fit.problem.errors(fit.u[None], r)
        for e, samples in zip(errors, run.samples, strict=True):
            spectra.append(_spectrum(*even(e[0], run.excitation.time[samples.index])))
    strongest = _chosen([_peaks(power / _mean(power), f) for f, power in spectra], TONES)
    local = [_peaks(power / _around(power), f) for f, power in spectra]
    return (*strongest, *_chosen(local, LOCAL, strongest))


def _spectrum(errors: Array, spacing: float) -> tuple[Array, Array]:
    """Frequencies [Hz] and power of a channel of mean 0."""
    size = FINER * len(errors)
    power = np.abs(np.fft.rfft(errors * np.hanning(len(errors)), size)) ** 2
    return np.asarray(np.fft.rfftfreq(size, spacing), np.float64), power


def _mean(power: Array) -> float:
    return float(power.mean()) or 1.0


def _around(power: Array) -> Array:
    """The power's mean around each frequency."""
    return np.maximum(uniform_filter1d(power, FINER * AROUND, mode="nearest"), 1e-12 * _mean(power))


def _peaks(power: Array, f: Array) -> list[Peak]:
    """(power, frequency [Hz]) of the strongest peaks."""
    middle = power[1:-1]
    top = np.flatnonzero((middle > power[:-2]) & (middle >= power[2:]) & (f[1:-1] > 0)) + 1
    order = top[np.argsort(-power[top])][:TONES]
    return [(float(power[k]), float(f[k])) for k in order]


def _chosen(peaks: list[list[Peak]], count: int, known: Sequence[float] = ()) -> tuple[float, ...]:
    """The strongest frequencies [Hz], none beside a stronger or a known one."""
    chosen: list[float] = []
    for _, f in sorted(itertools.chain(*peaks), reverse=True):
        if all(abs(f - other) > SAME * other for other in (*known, *chosen)):
            chosen.append(f)
    return tuple(chosen[:count])
