"""One recording: named channels over a common time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

ANGLES, VOLTAGES = ("phi1", "phi2"), ("V1", "V2")
INPUTS = ANGLES + VOLTAGES
MEASURED = ("x", "y", "vx", "vy", "ax", "ay", "phi1_meas", "phi2_meas", "i1", "i2")
UNITS = {
    "time": "s", "phi1": "rad", "phi2": "rad", "V1": "V", "V2": "V", "x": "m", "y": "m",
    "vx": "m/s", "vy": "m/s", "ax": "m/s^2", "ay": "m/s^2",
    "phi1_meas": "rad", "phi2_meas": "rad", "i1": "A", "i2": "A",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Recording:
    """Channels over time.

    ``time`` is (n,) in s, strictly increasing; every channel is (n,) in the unit of ``UNITS``, NaN
    where the channel took no sample.  ``name`` is the file's name.
    """

    name: str
    time: NDArray[np.float64]
    channels: Mapping[str, NDArray[np.float64]]
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        """The channel of that name, (n,); raises KeyError where it is absent."""
        return self.channels[channel]

    def __contains__(self, channel: object) -> bool:
        return channel in self.channels

    def __len__(self) -> int:
        return len(self.time)

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the measured channels that hold at least one sample, in the usual order."""
        here = (name for name in MEASURED if name in self.channels)
        return tuple(name for name in here if not np.isnan(self.channels[name]).all())
