"""`corexy hil diagnose` on the emulated board with an effect concealed in the plant.

`python -m tests.hil.commissioning` prints what was concealed, what the two rectangles said, which
motion was proposed and driven then, and what was said in the end; several minutes.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from corexy_fmi.commands.hil_diagnose import commission
from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.limits import Allowed
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import EffectUse
from tests.hil.rig import Rig, RigLines, Stage, yin


@dataclass(frozen=True)
class Concealed:
    """An effect in the plant, or none, and the noise [m] of the tracker."""

    effect: EffectUse | None
    noise: float
    seed: int = 0

    @property
    def text(self) -> str:
        """In words."""
        use = self.effect
        what = "nothing" if use is None else f"{use.name} at {use.location} {use.parameters}"
        return f"{what}, {1e6 * self.noise:g} um"


CASES = (
    Concealed(EffectUse("backlash", "motor1", {"gap": 0.03}), 1e-5),
    Concealed(None, 1e-5),
    Concealed(EffectUse("backlash", "motor1", {"gap": 0.02}), 3e-5),
    Concealed(EffectUse("stribeck_friction", "x", {"static_ratio": 2.0, "speed": 0.01}), 1e-5),
    Concealed(EffectUse("cable_drag", "x", {"stiffness": 30.0, "center": 0.0}), 2e-5),
)


def commissioned(case: Concealed, out: Path, experiments: int) -> dict[str, Any]:
    """The diagnosis of a case; its files lie in ``out``."""
    effects = () if case.effect is None else (case.effect,)
    with Rig(Stage(replace(yin(), effects=effects)), tracker_rate=100.0) as rig:
        rig.noise = np.random.default_rng(case.seed), case.noise
        setup = Setup(yin(), None, Allowed(), "rig", out, "rig", True, True, False, 24.0)
        return commission(setup, Board(rig), Tracker(RigLines(rig)), 1, experiments)


def said(document: dict[str, Any]) -> str:
    """Verdict and effects with their first parameter."""
    found = []
    for effect in document["effects"]:
        name, value = next(iter(effect["parameters"].items()))
        found.append(f"{effect['name']} at {effect['location']}, {name} {value['value']:.4g}")
    return f"{document['verdict']}: {' + '.join(found) or '-'}"


def main() -> None:
    """Print the table."""
    table = Table("concealed, noise", "two rectangles", "driven then", "in the end")
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            first = commissioned(case, Path(folder) / "first", 0)
            proposed = first["next_experiment"]
            last = first if proposed is None else commissioned(case, Path(folder) / "all", 2)
            driven = sorted(path.stem for path in Path(folder).glob("all/experiment?.csv"))
            table.add_row(case.text, said(first), ", ".join(driven) or "-", said(last))
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
