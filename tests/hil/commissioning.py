"""`corexy hil diagnose` on the emulated board with an effect concealed in the plant.

`python -m tests.hil.commissioning [CASE ...]` prints what was concealed, what was said after two
rectangles, which motion was proposed and driven then, and what was said in the end; minutes.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from corexy_fmi.commands import hil_diagnose
from corexy_fmi.commands.hil_diagnose import commission
from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.hil.board import Board
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
    Concealed(EffectUse("backlash", "motor1", {"gap": 0.03}), 1e-5, seed=1),
    Concealed(None, 1e-5),
    Concealed(EffectUse("backlash", "motor1", {"gap": 0.02}), 3e-5),
    Concealed(EffectUse("stribeck_friction", "x", {"static_ratio": 2.0, "speed": 0.01}), 1e-5),
    Concealed(EffectUse("cable_drag", "x", {"stiffness": 30.0, "center": 0.0}), 2e-5),
)


def commissioned(case: Concealed, out: Path, experiments: int, jobs: int = 1) -> dict[str, Any]:
    """The diagnosis of a case; its files lie in ``out``."""
    effects = () if case.effect is None else (case.effect,)
    with Rig(Stage(replace(yin(), effects=effects)), tracker_rate=100.0) as rig:
        rig.noise = np.random.default_rng(case.seed), case.noise
        setup = Setup(machine=yin(), port="rig", out=out, tracker="rig", centred=True, arm=True)
        return commission(setup, Board(rig), Tracker(RigLines(rig)), jobs, experiments)


def every_diagnosis(case: Concealed) -> list[dict[str, Any]]:
    """What was said after the two rectangles, and after each experiment."""
    documents: list[dict[str, Any]] = []
    write = hil_diagnose.write_diagnosis

    def keep(*words: Any) -> dict[str, Any]:
        documents.append(write(*words))
        return documents[-1]

    with (
        tempfile.TemporaryDirectory() as folder,
        patch.object(hil_diagnose, "write_diagnosis", keep),
    ):
        commissioned(case, Path(folder) / "result", 2, 2)
    return documents


def said(document: dict[str, Any]) -> str:
    """Verdict and effects with their first parameter."""
    found = []
    for effect in document["effects"]:
        name, value = next(iter(effect["parameters"].items()))
        found.append(f"{effect['name']} at {effect['location']}, {name} {value['value']:.4g}")
    return f"{document['verdict']}: {' + '.join(found) or '-'}"


def main(chosen: list[str]) -> None:
    """Print the table, of all cases or of those whose numbers are given."""
    table = Table("concealed, noise of the tracker", "what was said, one motion more each time")
    for case in [CASES[int(n)] for n in chosen] or CASES:
        lines = []
        for document in every_diagnosis(case):
            proposed = document["next_experiment"]
            lines += [said(document), *([f"  next: {proposed['why']}"] if proposed else [])]
        table.add_row(f"{case.text}, seed {case.seed}", "\n".join(lines))
    Console(width=150).print(table)


if __name__ == "__main__":
    main(sys.argv[1:])
