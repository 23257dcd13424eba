"""The FMU beside the board: the same angles at the same times, and how far apart both are."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType

import numpy as np

from corexy_fmi.hil.drive import Drive
from corexy_fmi.hil.segments import Plan
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording

STEP = 1e-3  # [s]
LATE = 0.05  # [s] by which the FMU follows the board, so that the tracker's samples are there
ANGLES = ("phi1", "phi2")


class Beside:
    """Steps the machine's FMU along a running drive; call it with the drive."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._stack = ExitStack()
        self._steps = 0
        self._text = ""

    def __enter__(self) -> Beside:
        from corexy_fmi.fmu.build import build_fmu
        from corexy_fmi.fmu.session import Session, unpacked

        folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="corexy-")))
        self._fmu = build_fmu(folder, self._machine)
        place = self._stack.enter_context(unpacked(self._fmu))
        self._session = self._stack.enter_context(Session(self._fmu, place))
        self._set, self._get = self._session.setter(ANGLES), self._session.getter(("x", "y"))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def __call__(self, drive: Drive) -> str:
        """Bring the FMU to the drive's time; the difference to the newest sample, as text."""
        before = self._steps
        while (self._steps + 1) * STEP <= drive.time - LATE and self._steps - before < 20:
            self._step(drive.plan)
        if self._steps == before or drive.tracker is None or not drive.tracker.samples:
            return self._text
        _, _, x, y = drive.tracker.samples[-1]
        fmu = self._get.read()
        self._text = f"board - FMU: x {1e6 * (x - fmu[0]):.0f}, y {1e6 * (y - fmu[1]):.0f} um"
        return self._text

    def _step(self, plan: Plan) -> None:
        now = self._steps * STEP
        ends = [[float(np.interp(t, plan.time, plan.angles[:, m])) for m in (0, 1)]
                for t in (now, now + STEP)]  # fmt: skip
        if self._steps == 0:
            self._session.start(0.0, dict(zip(ANGLES, ends[0], strict=True)))
        self._set.values[:2] = ends[0]  # type: ignore[assignment]
        self._set.apply()
        for m in (0, 1):
            self._set.rates[m] = (ends[1][m] - ends[0][m]) / STEP
        self._set.apply_rates()
        self._session.step(now, STEP)
        self._steps += 1

    def compare(self, made: Recording) -> Recording:
        """The recording with the rms difference to the FMU [m] in its metadata."""
        from corexy_fmi.fmu.build import build_fmu
        from corexy_fmi.fmu.runner import run_fmu

        if "x" not in made:
            return made
        with tempfile.TemporaryDirectory(prefix="corexy-") as folder:
            fmu = build_fmu(Path(folder), self._machine)
            response = run_fmu(fmu, made, self._machine)
        gaps = [float(np.sqrt(np.nanmean((made[a] - response[a]) ** 2))) for a in "xy"]
        line = f"rms_x={gaps[0]!r} rms_y={gaps[1]!r}"
        return replace(made, metadata={**made.metadata, "beside_fmu": line})
