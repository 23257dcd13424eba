"""The reference's memory of what the sensor saw: by time, as coarse as the kernel's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.layout import Layout

Array = NDArray[np.float64]
RING, SPARE = 512, 8  # samples that the kernel remembers, those kept beyond the history


def history(layout: Layout) -> float:
    """The longest look back [s] of a layout's effects."""
    return max((i.effect.history for i in layout.instances), default=0.0) or 0.05


class Past:
    """Samples at least history / (RING - SPARE) apart, linear between them."""

    def __init__(self, length: float) -> None:
        """``length`` is the history [s]."""
        self.spacing = length / (RING - SPARE)
        self.times: list[float] = []
        self.values: list[Array] = []

    def keep(self, time: float, value: Array) -> None:
        """Remember a sample unless the last one is too near."""
        if not self.times or time >= self.times[-1] + self.spacing:
            self.times.append(time)
            self.values.append(value)

    def recall(self, time: float, now: float, present: Array) -> Array:
        """The sample at a time, or the oldest; the present one closes the row."""
        times = [*self.times[-RING:], now]
        values = np.array([*self.values[-RING:], present])
        return np.array([np.interp(time, times, column) for column in values.T])
