"""Results on the disk: a line for each case, whole or absent."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from benchmarks import outcome
from benchmarks.outcome import RESULTS

Entry = dict[str, Any]
FOLDER = RESULTS
ENGINE = ("src", "fmu_src", "models")  # what a verdict depends on


def commit() -> str:
    """Hash of the commit that runs, with + where the engine differs from it."""
    return outcome.commit(*ENGINE)


def path_of(index: int, shards: int) -> Path:
    """A shard's file."""
    return FOLDER / (f"shop.{index}.jsonl" if shards > 1 else "shop.jsonl")


def read(path: Path) -> list[Entry]:
    """Entries of a file, none where there is none."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def stored() -> list[Entry]:
    """Of each case the newest result, whatever file it is in."""
    entries = [e for path in sorted(FOLDER.glob("shop*.jsonl")) for e in read(path)]
    newest = {e["name"]: e for e in sorted(entries, key=lambda e: str(e["at"]))}
    return list(newest.values())


def keep(path: Path, entry: Entry) -> None:
    """One more result, in place of an older one of its case: written beside, then renamed."""
    entries = [e for e in read(path) if e["name"] != entry["name"]]
    lines = [json.dumps(e, sort_keys=True) + "\n" for e in (*entries, entry)]
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".new")
    beside.write_text("".join(lines), encoding="utf-8")
    os.replace(beside, path)
