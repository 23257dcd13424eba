"""The sensor of x and y that is drawn: rows, samples, noise, steps, zero; counts of dc motors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from benchmarks.shop.stage import Array
from benchmarks.strange.machines import Random, spread

RATE, ROWS = (100.0, 1000.0), (200.0, 1000.0)  # of samples, of rows [1/s]
NOISE, COLOUR, STEPS = (3e-6, 40e-6), (0.2, 0.9), (0.5, 3.0)  # [m], AR(1), steps over noise
OFFSET = 5e-3  # [m] of a zero that nobody knows
RUNS = 3
LOOPED, COUNTS = (1000.0, 2000.0), (2000, 4000, 4096, 8000)  # dc: rows [1/s]; of encoders, a turn
COLOURED, STEPPED, ZEROED, ENCODED = 0.5, 0.25, 0.3, 0.5  # shares


@dataclass(frozen=True)
class Sensor:
    """``row`` [s] between rows, a sample every so many; noise of ``std`` [m] and AR(1) colour
    ``rho`` from sample to sample; ``count`` [m] of an encoder, 0 without; ``offsets`` [m] of each
    recording's x and y, None where they have the inputs' zero and the files say so; ``counts`` of
    the motors' encoders a turn, 0 where these are not recorded.
    """

    row: float
    every: int
    std: float
    rho: float
    count: float
    offsets: Array | None
    counts: int = 0

    def seen(self, xy: Array, random: Random) -> Array:
        """Samples [m] of places, a row each."""
        white = self.std * np.sqrt(1 - self.rho**2) * random.standard_normal(xy.shape)
        white[0] /= np.sqrt(1 - self.rho**2)  # from the start as loud as later
        noisy = xy + lfilter([1.0], [1.0, -self.rho], white, axis=0)
        return np.round(noisy / self.count) * self.count if self.count else noisy

    def counted(self, angles: Array) -> Array:
        """What encoders show of motors' angles [rad], whose zero is a count's middle."""
        count = 2 * np.pi / self.counts
        return np.round(angles / count) * count

    def whitened(self, change: Array) -> Array:
        """A change of the samples [m] over the noise; its mean is lost with an unknown zero."""
        felt = change if self.offsets is None else change - change.mean(0)
        variance = self.std**2 + self.count**2 / 12
        rho = self.rho * self.std**2 / variance
        first, rest = felt[:1], (felt[1:] - rho * felt[:-1]) / np.sqrt(1 - rho**2)
        return np.concatenate([first, rest]) / np.sqrt(variance)


def _rows(random: Random) -> tuple[float, int]:
    """Rows at the rate of the samples or denser, 200 to 1000 a second."""
    rate = spread(random, *RATE)
    dense = [k for k in (1, 2, 4, 8) if ROWS[0] <= rate * k <= ROWS[1]]
    every = int(random.choice(dense))
    return round(1 / (rate * every), 6), every


def draw_sensor(random: Random) -> Sensor:
    """Rows, noise and zero of a sensor."""
    row, every = _rows(random)
    std = spread(random, *NOISE)
    rho = random.uniform(*COLOUR) if random.random() < COLOURED else 0.0
    count = std * random.uniform(*STEPS) if random.random() < STEPPED else 0.0
    offsets = random.uniform(-OFFSET, OFFSET, (RUNS, 2))
    known = random.random() < ZEROED
    return Sensor(row, every, std, rho, count, None if known else offsets)


def looped(random: Random, sensor: Sensor) -> Sensor:
    """The sensor beside dc motors, whose loop runs once a row, and their encoders' counts."""
    rate = 1 / (sensor.row * sensor.every)
    dense = np.arange(np.ceil(LOOPED[0] / rate), LOOPED[1] // rate + 1)
    every = int(random.choice(dense))
    counts = int(random.choice(COUNTS)) if random.random() < ENCODED else 0
    return replace(sensor, row=round(1 / (rate * every), 6), every=every, counts=counts)
