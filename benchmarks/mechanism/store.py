"""The results file: what agrees, seals, and cases, each with the commit that ran."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from corexy_fmi.files import write_beside

FILE = Path("benchmarks/results/mechanism.json")


def read(path: Path = FILE) -> dict[str, Any]:
    """What is kept; nothing where the file is not there yet."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def keep(key: str, value: Any, path: Path = FILE) -> None:
    """Put a value under a key, the rest as it is; written beside and renamed."""
    kept = read(path) | {key: value}
    with write_beside(path) as beside:
        beside.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def append(key: str, entry: dict[str, Any], path: Path = FILE) -> None:
    """Add an entry to a list."""
    keep(key, [*read(path).get(key, []), entry], path)
