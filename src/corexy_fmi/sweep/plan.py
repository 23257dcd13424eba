"""What one sweep is: machine, rectangle, ranges, and how its sets are cut into chunks."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from corexy_fmi import __version__
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.call import LANES, Excitation
from corexy_fmi.kernel.compiler import kernel_library
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine, machine_to_toml
from corexy_fmi.motion import check_stage, command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import excitation
from corexy_fmi.sweep.vary import Range

FORMAT = 1
CHUNK = 4096  # sets of one task: a second or so
WITHIN = 1e-5  # [m] of the place where it comes to rest


@dataclass(frozen=True)
class Plan:
    """A sweep; ``within`` [m] is how near to its last place a set has settled.

    Raises InputError for counts below one, and where a set could leave the stage.
    """

    machine: Machine
    shape: Rectangle
    ranges: tuple[Range, ...]
    sets: int
    seed: int = 0
    chunk: int = CHUNK
    within: float = WITHIN

    def __post_init__(self) -> None:
        for name in ("sets", "chunk"):
            if getattr(self, name) < 1:
                raise InputError(f"{name}: found {getattr(self, name)!r}, expected at least 1")
        if not (np.isfinite(self.within) and self.within > 0):
            raise InputError(f"within: found {self.within!r}, expected a positive number [m]")
        check_geometry(self)
        if self.machine.drive == "dc" and self.machine.controller is None:
            name = self.machine.name
            raise InputError(f"machine {name!r}: no [controller], expected its kp and kd")

    @property
    def chunks(self) -> int:
        """How many tasks there are."""
        return -(-self.sets // self.chunk)

    def rows(self, index: int) -> range:
        """Numbers of the sets in a chunk."""
        return range(index * self.chunk, min((index + 1) * self.chunk, self.sets))

    def order(self) -> Recording:
        """The motor angles that all sets share."""
        radius = self.machine.parameters["pulley_radius"]
        return command(self.shape.motion, radius, name="the rectangle")

    def excitation(self) -> Excitation:
        """The same as the kernel takes it, with the loop of a dc machine."""
        return excitation(self.machine, self.order())

    def document(self) -> dict[str, Any]:
        """All that the results depend on, as JSON; the number of workers is not among it."""
        return {
            "format": FORMAT,
            "package": __version__,
            "kernel": kernel_library(bundled_layout(), LANES).stem,
            "machine": machine_to_toml(self.machine),
            "rectangle": asdict(self.shape),
            "vary": [_told(r) for r in self.ranges],
            "sets": self.sets,
            "seed": self.seed,
            "chunk": self.chunk,
            "within": self.within,
        }


def check_geometry(plan: Plan) -> None:
    """Raises InputError where the smallest stage of the ranges is too small for the rectangle."""
    numbers = dict(plan.machine.parameters)
    for r in plan.ranges:
        if r.place.key in numbers:
            numbers[r.place.key] = r.high if r.place.key == "clip_spacing" else r.low
    if numbers["clip_spacing"] >= numbers["bridge_pulley_spacing"]:
        raise InputError(
            f"vary: clip_spacing reaches {numbers['clip_spacing']:g} m, expected less than "
            f"bridge_pulley_spacing, {numbers['bridge_pulley_spacing']:g} m at least"
        )
    check_stage(plan.order(), replace(plan.machine, parameters=numbers))


def _told(r: Range) -> dict[str, Any]:
    scale = "log" if r.log else "uniform"
    about = {"key": r.place.key, "unit": r.place.unit}
    return {**about, "low": r.low, "high": r.high, "scale": scale}
