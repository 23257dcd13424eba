"""What the pages of real cases share: calls of the command line, tables, how a diagnosis reads."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[1]
PAGES, IMAGES = ROOT / "docs" / "cases", ROOT / "docs" / "images" / "cases"
KEPT = ("verdict", "effects", "nearest", "ambiguous_between", "ambiguous_sets", "fit", "heldout",
        "retuned", "located", "not_excluded", "seconds")  # fmt: skip


def corexy(folder: Path, *words: str) -> str:
    """What a command prints."""
    command = [sys.executable, "-m", "corexy_fmi", *words]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def kept(document: Mapping[str, Any]) -> dict[str, Any]:
    """What a page needs of a diagnosis."""
    return {key: document[key] for key in KEPT}


def rms(values: NDArray[np.float64]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *rows])


def estimate(entry: Mapping[str, Any], digits: int = 4) -> str:
    """A number with its unit and its 95 % interval."""
    value, low, high = (f"{x:.{digits}g}" for x in (entry["value"], *entry["ci95"]))
    return f"{value} {entry['unit']} ({low} .. {high})"


def named(run: Mapping[str, Any]) -> str:
    """What a diagnosis names."""
    return " + ".join(f"{e['name']} at {e['location']}" for e in run["effects"]) or "none"


def offered(run: Mapping[str, Any]) -> str:
    """The catalogue's sets where it does not explain, with their share of the best gain."""
    sets = (f"{named(each)} ({100 * each['gain_share']:.0f} %)" for each in run["nearest"])
    return "; ".join(sets) or "none"
