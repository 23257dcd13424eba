"""A benchmark's outcome as JSON: its numbers with the commit and the command that made them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"


def commit(*of: str) -> str:
    """Hash of the commit that runs, with + where the tree, or only these folders of it, differ from
    it; empty without git.
    """
    try:
        asked = ("rev-parse", "HEAD"), ("status", "--porcelain", "--untracked-files=no", *of)
        told = [subprocess.run(["git", *a], capture_output=True, text=True).stdout for a in asked]
    except OSError:
        return ""
    return told[0].strip() + ("+" if told[1].strip() else "")


def write_outcome(name: str, command: str, document: Mapping[str, Any]) -> Path:
    """Write results/NAME.json; returns its path."""
    path = RESULTS / f"{name}.json"
    path.parent.mkdir(exist_ok=True)
    head = {"commit": commit(), "command": command}
    path.write_text(json.dumps(head | dict(document), indent=1) + "\n", encoding="utf-8")
    return path


def keep_page(page: Path, text: str, command: str, *, check: bool) -> int:
    """Write a page, or with ``check`` only tell where it is stale; the exit status."""
    if not check:
        page.write_text(text, encoding="utf-8")
        return 0
    stale = not page.is_file() or page.read_text(encoding="utf-8") != text
    if stale:
        print(f"stale: {page.name}; run {command} --render", file=sys.stderr)
    return int(stale)
