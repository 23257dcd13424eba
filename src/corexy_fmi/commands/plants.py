"""The two plants that a command can drive: the FMU through fmpy, and the model itself."""

from __future__ import annotations

import tempfile
from enum import StrEnum
from pathlib import Path

import numpy as np

from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording


class Plant(StrEnum):
    """What is driven."""

    fmu = "fmu"
    model = "model"


def run(plant: Plant, machine: Machine, command: Recording, own: dict[str, Effect]) -> Recording:
    """Response at the rows of a command; an FMU is built for this machine.

    ``own`` are effects of the user's that the machine may have, by name.
    """
    from corexy_fmi.kernel.layout import layout_with

    layout = layout_with(own)
    if plant is Plant.model:
        from corexy_fmi.simulate import simulate

        return _finite(simulate(machine, command, layout))
    from corexy_fmi.fmu.build import build_fmu
    from corexy_fmi.fmu.runner import run_fmu

    with tempfile.TemporaryDirectory(prefix="corexy-") as folder:
        fmu = build_fmu(Path(folder), machine, effects=catalogue() | own)
        return _finite(run_fmu(fmu, command, machine, layout))


def _finite(response: Recording) -> Recording:
    """The response.  Raises InputError where it is none: no machine follows such inputs."""
    for name in ("x", "y"):
        lost = np.flatnonzero(~np.isfinite(response[name]))
        if len(lost):
            raise InputError(
                f"{response.name}: {name} is {response[name][lost[0]]} at "
                f"{response.time[lost[0]]:g} s, expected inputs and a machine that stay finite"
            )
    return response
