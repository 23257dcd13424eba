"""Noise of a measured channel: an autoregressive model, and whitening by it.

e_n = sum_j a_j e_{n-j} + w_n, w white (Ljung, System Identification, 1999).  A gap in the samples
starts the filter anew: its first samples are only divided by the marginal standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import toeplitz

from corexy_fmi.engine.data.samples import Samples
from corexy_fmi.engine.data.steps import least_step, sensor_step
from corexy_fmi.kernel.call import Array

ORDERS = (0, 1, 2, 4, 8)
FINEST = (
    1e-7  # of a channel's own standard deviation: what no sensor resolves, nor a model foretells
)


@dataclass(frozen=True, eq=False)
class Noise:
    """Coefficients a (p,), standard deviation of the innovations and of the noise itself."""

    coefficients: Array
    innovation: float
    marginal: float

    def whiten(self, errors: Array, breaks: np.ndarray) -> Array:
        """Whitened errors, same shape (.., m), unit variance where the model holds."""
        fresh = np.flatnonzero(warm_up(breaks, len(self.coefficients)))
        with np.errstate(over="ignore", invalid="ignore"):  # a run that broke down is not finite
            white = np.asarray(errors / self.innovation)
            for lag, a in enumerate(self.coefficients / self.innovation, 1):
                white[..., lag:] -= a * errors[..., :-lag]
            if len(fresh):
                white[..., fresh] = errors[..., fresh] / self.marginal
        return white

    def log_scale(self, breaks: np.ndarray) -> float:
        """Sum of the log standard deviations of the whitened samples [nats]."""
        fresh = int(warm_up(breaks, len(self.coefficients)).sum())
        return fresh * float(np.log(self.marginal)) + (len(breaks) - fresh) * float(
            np.log(self.innovation)
        )


Noises = tuple[tuple[Noise, ...], ...]  # of each channel of each run


def warm_up(breaks: np.ndarray, order: int) -> np.ndarray:
    """True (m,) on the first ``order`` samples after each break."""
    fresh = np.zeros(len(breaks), dtype=bool)
    starts = np.flatnonzero(breaks)
    for shift in range(order):
        at = starts + shift
        fresh[at[at < len(breaks)]] = True
    return fresh


def _autocovariance(errors: Array, breaks: np.ndarray, lags: int) -> Array:
    """Autocovariance (lags + 1,): the mean over pairs that no break parts, tapered by the lag.

    Without breaks it is the usual biased estimate, which keeps Yule-Walker's filter stable.
    """
    block, count = np.cumsum(breaks), len(errors)
    result = np.zeros(lags + 1)
    for lag in range(min(lags + 1, count)):
        joined = block[lag:] == block[: count - lag]
        products = errors[lag:][joined] * errors[: count - lag][joined]
        result[lag] = (1 - lag / count) * np.sum(products) / max(len(products), 1)
    return result


def estimate(errors: Array, breaks: np.ndarray, floor: float = 1e-12) -> Noise:
    """The autoregressive model of an error sequence (m,); its order by BIC among ``ORDERS``.

    White noise of ``floor`` is thought added: smooth errors are foretold no better than that.
    """
    centred = errors - errors.mean()
    covariance = _autocovariance(centred, breaks, max(ORDERS))
    covariance[0] += floor**2
    marginal = float(np.sqrt(covariance[0]))
    best: tuple[float, Noise] | None = None
    for order in (o for o in ORDERS if o < len(errors) // 10):
        a = _yule_walker(covariance, order)
        noise = Noise(a, 1.0, marginal)
        raw = noise.whiten(centred, breaks) if order else centred
        settled = ~warm_up(breaks, order)
        new = float(np.mean(raw[settled] ** 2)) + floor**2 * (1 + float(a @ a))
        fitted = Noise(a, float(np.sqrt(new)) if settled.any() else marginal, marginal)
        score = fitted.log_scale(breaks) + 0.5 * order * np.log(len(errors))
        if best is None or score < best[0]:
            best = (score, fitted)
    return best[1] if best else Noise(np.zeros(0), marginal, marginal)


def _yule_walker(covariance: Array, order: int) -> Array:
    """Coefficients (order,) of the Yule-Walker equations."""
    if not order:
        return np.zeros(0)
    matrix = toeplitz(covariance[:order]) + 1e-9 * covariance[0] * np.eye(order)
    return np.asarray(np.linalg.solve(matrix, covariance[1 : order + 1]))


def white(std: float) -> Noise:
    """White noise of a standard deviation."""
    return Noise(np.zeros(0), std, std)


def size(models: Noises) -> float:
    """Geometric mean of the noises' standard deviations over all channels of all runs."""
    return float(np.exp(np.mean([np.log(m.marginal) for of_run in models for m in of_run])))


def quick_noise(samples: Samples) -> float:
    """Standard deviation of white noise on a smooth signal, from third differences, robustly.

    At least that of rounding to the sensor's steps: a coarse sensor stands still most of the time.
    """
    third = np.abs(np.diff(samples.value, 3))
    rounding = least_step(samples.value) / np.sqrt(12.0)
    return max(float(np.median(third)) / 0.6745 / np.sqrt(20.0), rounding, finest(samples))


def finest(samples: Samples) -> float:
    """The least standard deviation that counts as noise of a channel: where a recording has less,
    as one that was simulated, what is left of it would be the model's own arithmetic; of a motor's
    encoder one count, for errors of rounding are alike for as long as rows are whole counts apart.
    """
    count = sensor_step(samples.value) if samples.of_motor else 0.0
    return max(FINEST * float(np.std(samples.value)), count, 1e-12)


def difference_noise(errors: Array, floor: float) -> tuple[Noise, Array]:
    """The noise, and ``floor``, that the differences of neighbouring loops (k, n) show, each loop's
    mean apart.

    The difference of the same place of two loops holds noise and drift alone, whatever the model
    lacks: its size over sqrt(2) is the noise, its correlation the noise's colour.
    """
    differences = np.diff(errors, axis=0) / np.sqrt(2.0)
    differences = differences - differences.mean(axis=1, keepdims=True)
    breaks = np.zeros(differences.shape, dtype=bool)
    breaks[:, 0] = True
    return estimate(differences.ravel(), breaks.ravel(), floor), differences.ravel()
