"""The models as the paper's figures need them, run through one FMU with fmpy."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.reproduce import paths
from corexy_fmi.reproduce.paper import MODELS

Array = NDArray[np.float64]


class Plant:
    """One machine behind an FMU; its parameters and its fidelity are set for each run."""

    def __init__(self, fmu: Path, machine: Machine) -> None:
        self.fmu, self.machine = fmu, machine
        self.radius = machine.parameters["pulley_radius"]

    def run(
        self, command: Recording, model: str, parameters: Mapping[str, float] | None = None
    ) -> Recording:
        """Response of a model, a name of `MODELS`, with the machine's or other parameters."""
        chosen = replace(
            self.machine,
            fidelity=MODELS[model],
            parameters=self.machine.parameters if parameters is None else parameters,
        )
        return run_fmu(self.fmu, command, chosen)

    def corner(
        self, turn: str, speed: float, model: str, parameters: Mapping[str, float] | None = None
    ) -> tuple[float, float]:
        """Contour error, eq. (17), and overshoot [m] at a single corner at a speed [m/s]."""
        corner, order = paths.at_speed(turn, speed, self.radius)
        response = self.run(order, model, parameters)
        path = np.column_stack([response["x"], response["y"]])
        return corner.error(path), corner.overshoot(path)


@contextmanager
def plant(machine: Machine) -> Iterator[Plant]:
    """The FMU of a machine, gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="corexy-") as folder:
        yield Plant(build_fmu(Path(folder), machine), machine)
