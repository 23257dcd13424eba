"""Results and seals on the disk: a line for each case, whole or absent."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.outcome import RESULTS
from benchmarks.shop.store import Entry, read

FOLDER = RESULTS
SEALS = ".seals.jsonl"


def path_of(index: int, shards: int) -> Path:
    """A shard's file."""
    return FOLDER / (f"strange.{index}.jsonl" if shards > 1 else "strange.jsonl")


def stored() -> list[Entry]:
    """All results, whatever file they are in: by origin, as these were first run, and number."""
    paths = sorted(p for p in FOLDER.glob("strange*.jsonl") if not p.name.endswith(SEALS))
    entries = sorted((e for path in paths for e in read(path)), key=lambda e: str(e["at"]))
    origins = list(dict.fromkeys(e["origin"] for e in entries))
    newest = {e["name"]: e for e in entries}.values()
    return sorted(newest, key=lambda e: (origins.index(e["origin"]), e["number"]))


def evidence_path(index: int, shards: int) -> Path:
    """A shard's file of E after retuning (`evidence.py`)."""
    return FOLDER / (f"evidence.{index}.strange.jsonl" if shards > 1 else "evidence.strange.jsonl")


def evidences() -> dict[str, list[float]]:
    """E of each cause, by the name of its case."""
    entries = [e for path in sorted(FOLDER.glob("evidence*.strange.jsonl")) for e in read(path)]
    return {e["name"]: e["E"] for e in entries}


def waiting(numbers: Sequence[int], origin: str) -> list[int]:
    """Numbers that have no result of this origin yet."""
    done = {e["number"] for e in stored() if e["origin"] == origin}
    return [n for n in numbers if n not in done]
