"""The position loop of a dc board, from the machine's [controller], in the firmware's integers."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.hil.limits import Scale
from corexy_fmi.machine.record import Machine

_GAINS = struct.Struct("<iiHHH")
LARGEST_GAIN = 65535  # beyond it the firmware's products leave 32 bits
LARGEST_SUPPLY = 32.0  # [V]: the firmware tells voltages as 16 bits of millivolts
ASTRAY = 0.5  # [rad] from its reference at which a motor does not follow


@dataclass(frozen=True)
class Gains:
    """kp [mV/count], kd [mV per count a tick] in 1/256; voltages [mV]; ``astray`` [counts]."""

    kp: int
    kd: int
    supply: int
    largest: int
    astray: int

    @classmethod
    def of(cls, machine: Machine, scale: Scale, supply: float) -> Gains:
        """From the machine's controller and the motors' supply [V].

        Raises InputError without a controller, or for what the firmware cannot hold.
        """
        if machine.controller is None:
            raise InputError(f"machine {machine.name!r}: no [controller], expected its kp and kd")
        if not 1 <= supply <= LARGEST_SUPPLY:
            raise InputError(f"supply: found {supply!r}, expected 1 to {LARGEST_SUPPLY:g} V")
        count = 2 * np.pi / scale.counts
        kp = round(machine.controller.kp * count * 1e3 * 256)
        kd = round(machine.controller.kd * count / scale.tick * 1e3 * 256)
        if max(kp, kd) > LARGEST_GAIN:
            raise InputError(
                f"machine {machine.name!r}, [controller]: too stiff for {scale.counts} counts a "
                "revolution, expected a lower gain or a finer encoder"
            )
        millivolts = round(supply * 1e3)
        return cls(kp, kd, millivolts, millivolts, round(ASTRAY / count))

    def pack(self) -> bytes:
        """Body of GAINS."""
        return _GAINS.pack(self.kp, self.kd, self.supply, self.largest, self.astray)
