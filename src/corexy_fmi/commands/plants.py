"""The two plants that a command can drive: the FMU through fmpy, and the model itself."""

from __future__ import annotations

import tempfile
from enum import StrEnum
from pathlib import Path

from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording


class Plant(StrEnum):
    """What is driven."""

    fmu = "fmu"
    model = "model"


def run(plant: Plant, machine: Machine, command: Recording) -> Recording:
    """Response at the rows of a command; an FMU is built for this machine."""
    if plant is Plant.model:
        from corexy_fmi.simulate import simulate

        return simulate(machine, command)
    from corexy_fmi.fmu.build import build_fmu
    from corexy_fmi.fmu.runner import run_fmu

    with tempfile.TemporaryDirectory(prefix="corexy-") as folder:
        return run_fmu(build_fmu(Path(folder), machine), command, machine)
