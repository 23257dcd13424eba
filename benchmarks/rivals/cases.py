"""The files that all ways are given: the bundled examples, and mechanisms of the sealed cases."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.mechanism.store import read
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.recording import Recording, read_recording

EXAMPLES = Path("examples")
BUNDLED = ("1_concealed", "2_twin", "3_null")
Loaded = tuple[list[Recording], list[Recording], Machine]


@dataclass(frozen=True)
class Given:
    """A case: its name, its files, what was planted, and the noise [m] that was put on it.

    ``known`` is the engine's diagnosis where the sealed run has kept it already.
    """

    name: str
    files: Loaded
    truth: dict[str, Any]
    known: dict[str, Any] | None = None

    @property
    def cause(self) -> list[str]:
        """Names of the planted effects."""
        return sorted({e["name"] for e in self.truth["effects"]})


def bundled(name: str) -> Given:
    """One of the examples."""
    folder = EXAMPLES / name
    train = [read_recording(folder / f"train{n}.csv") for n in (1, 2)]
    files = train, [read_recording(folder / "holdout1.csv")], load_machine(folder / "machine.toml")
    return Given(name, files, json.loads((folder / "truth.json").read_text(encoding="utf-8")))


def sealed(name: str) -> Given:
    """A case of `benchmarks.mechanism.proof`, drawn again from its seed."""
    from benchmarks.concealed.blind import load
    from benchmarks.mechanism.draw import draw

    entry = next(e for e in read()["cases"] if e["name"] == name)
    case = draw(entry["seed"], entry["truth"]["mechanism"])
    known = {"document": entry["document"], "commit": entry["commit"]}
    return Given(name, load(case), case.truth, known)


def given(name: str) -> Given:
    """The case of that name."""
    return bundled(name) if name in BUNDLED else sealed(name)
