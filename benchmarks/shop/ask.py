"""What the engine says of a folder's recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.hidden_page import told as kept
from benchmarks.shop.case import HOLDOUT, TRAIN
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.diagnose import Progress as Hears
from corexy_fmi.errors import InputError
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import read_recording

REFUSED: dict[str, Any] = {"verdict": "refused", "effects": [], "coordinate": None, "state": None}


def ask(folder: Path, machine: str | Path, progress: Hears | None = None) -> dict[str, Any]:
    """What is kept of a diagnosis; that a file is refused is an answer too."""
    try:
        train, holdout = ([read_recording(folder / n) for n in names] for names in (TRAIN, HOLDOUT))
        found = diagnose(train, holdout, load_machine(machine), progress=progress)
    except InputError as error:
        return REFUSED | {"error": str(error).replace(f"{folder}/", "")}
    located = found.document["located"]
    return kept(found.document) | {key: located[key] for key in ("coordinate", "state")}
