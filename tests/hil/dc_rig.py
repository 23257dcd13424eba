"""The dc loop in lock-step: PWM of the emulated board drives the FMU, its angles the encoders."""

from __future__ import annotations

from contextlib import ExitStack

import numpy as np

from corexy_fmi.fmu.runner import parameter_values
from corexy_fmi.fmu.session import Session, unpacked
from corexy_fmi.machine import load_machine
from tests.hil.emulator import FREQUENCY, Emulator
from tests.hil.rig import SLICE, Rig, fmu

COUNTS = 4000  # of a revolution
SUPPLY = 24.0  # [V]
PARTS = 5  # of a slice: the encoders follow the FMU by a fifth of a millisecond


class DcStage:
    """The FMU of the dc machine, moved by volts."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        place = self._stack.enter_context(unpacked(fmu()))
        self._session = self._stack.enter_context(Session(fmu(), place))
        values = parameter_values(load_machine("yin2018_dc"))
        self._session.start(0.0, {"V1": 0.0, "V2": 0.0}, values)
        self._set = self._session.setter(("V1", "V2"))
        self._get = self._session.getter(("x", "y", "phi1_meas", "phi2_meas"))
        self._steps, self._step = 0, SLICE / PARTS
        self.x = self.y = 0.0
        self.counts = (0, 0)

    def move(self, volts: tuple[float, float]) -> None:
        """A fifth of a slice at these voltages [V]."""
        self._set.values[:] = volts
        self._set.apply()
        self._session.step(self._steps * self._step, self._step)
        self._steps += 1
        self.x, self.y, a, b = self._get.read()
        one = COUNTS / (2 * np.pi)
        self.counts = round(a * one), round(b * one)

    def close(self) -> None:
        self._stack.close()


class DcRig(Rig):
    """``wires`` maps the FMU's counts to what the encoders show: a fault can sit there."""

    def __init__(self, tracker_rate: float = 1000.0) -> None:
        super().__init__(None, tracker_rate)
        self.emulator.close()
        self.emulator = Emulator("dc")
        self.dc = DcStage()
        self.volts: tuple[float, float] = (0.0, 0.0)
        self.wires = lambda counts: counts

    def read(self, wait: float) -> bytes:
        """One slice passes, in parts."""
        self._slices += 1
        data = b""
        for part in range(1, PARTS + 1):
            self.emulator.encoders(*self.wires(self.dc.counts))
            share = self._slices - 1 + part / PARTS
            ran = self.emulator.run_to(round(share * SLICE * FREQUENCY))
            signs = [-1 if ran.port_d & bit else 1 for bit in (0x20, 0x40)]
            one, two = (s * SUPPLY * d / 65536 for s, d in zip(signs, ran.duties, strict=True))
            self.volts = one, two
            self.dc.move(self.volts)
            data += ran.data
        self.counts = self.dc.counts
        if self._slices % self._every == 0:
            self._sample(self.dc)
        return self.to_host(data)

    def close(self) -> None:
        super().close()
        self.dc.close()
