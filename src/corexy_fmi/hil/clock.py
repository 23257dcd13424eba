"""Two clocks of which one is read through a link: offset and drift from the fastest answers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

BEST = 0.2  # share of the round trips that count: the fastest
DRIFT_SPAN = 20.0  # [s] below which a drift cannot be told from latency
WRAP = 1 << 32


@dataclass
class Clock:
    """The board's clock by the host's.

    ``samples`` are host times before and after [s] and the board's tick, unwrapped.
    """

    tick_hz: int = 1
    samples: list[tuple[float, float, float]] = field(default_factory=list)
    _last: int | None = None
    _turns: int = 0

    def add(self, sent: float, heard: float, tick: float) -> None:
        """One exchange: host times [s], and the board's tick between them."""
        self.samples.append((sent, heard, self.unwrapped(tick)))

    def unwrapped(self, tick: float) -> float:
        """A tick beyond its 32 bits; call it in the order of time, to within half a turn."""
        low = tick % WRAP
        last = int(low) if self._last is None else self._last
        ahead = (low - last) % WRAP
        if ahead < WRAP / 2:
            self._turns += low < last
            self._last = int(low)
            return self._turns * WRAP + low
        return (self._turns - (low > last)) * WRAP + low

    @property
    def round_trips(self) -> NDArray[np.float64]:
        """Of all samples (n,) [s]."""
        table = np.array(self.samples).reshape(-1, 3)
        return table[:, 1] - table[:, 0]

    def fit(self) -> tuple[float, float]:
        """Offset and rate: board time [s] = offset + rate * host time [s].

        The rate is 1 for less than 20 s of samples.  Raises ValueError without any.
        """
        if not self.samples:
            raise ValueError("no clock samples")
        table = np.array(self.samples)
        middle, board = table[:, :2].mean(axis=1), table[:, 2] / self.tick_hz
        trips = self.round_trips
        best = trips <= np.quantile(trips, BEST)
        if np.ptp(middle[best]) < DRIFT_SPAN:
            return float(np.mean(board[best] - middle[best])), 1.0
        centre = middle[best].mean()
        rate = 1 + np.polyfit(middle[best] - centre, board[best] - middle[best], 1)[0]
        return float(np.mean(board[best] - rate * middle[best])), float(rate)


def lower_envelope(sent: NDArray[np.float64], heard: NDArray[np.float64]) -> tuple[float, float]:
    """One-way stamps of another clock: host time = offset + rate * its time, at the least latency.

    ``sent`` (n,) [s] in the sender's clock, ``heard`` (n,) [s] in the host's.  A latency that all
    samples share stays in the offset; nobody can see it.
    """
    gap = heard - sent
    if np.ptp(sent) < DRIFT_SPAN:
        return float(gap.min()), 1.0
    parts = np.array_split(np.arange(len(sent)), 20)
    fastest = np.array([part[np.argmin(gap[part])] for part in parts if len(part)])
    slope, offset = np.polyfit(sent[fastest], gap[fastest], 1)
    left = gap - slope * sent
    return float(min(offset, left.min())), 1 + float(slope)
