"""Diagnoses of recordings as a workshop would make them: are they right, or silent?

    python -m benchmarks.shop [--only NAME ...] [--shard i/n] [--again] [--render]

Each case is simulated, written as CSV, read and diagnosed; its result is a line of
benchmarks/results/shop.jsonl (of shop.i.jsonl with --shard), and docs/shop.md's table is rendered
from all of them.  Cases that have a result are skipped; --again runs them anew where their result
is another commit's.  Ctrl-C loses only the case that runs.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.progress import Progress

from benchmarks.shop.ask import Hears, ask
from benchmarks.shop.case import Case, write
from benchmarks.shop.cases import CASES
from benchmarks.shop.grade import grade
from benchmarks.shop.page import COMMAND, render
from benchmarks.shop.store import commit, keep, path_of, stored


def told(case: Case, progress: Hears | None = None) -> dict[str, Any]:
    """What the engine says of a case's files."""
    with tempfile.TemporaryDirectory() as name:
        write(case, Path(name))
        return ask(Path(name), case.machine, progress)


def run(case: Case, mark: str, progress: Hears | None = None) -> dict[str, Any]:
    """A case's line of results."""
    begun = time.monotonic()
    said = told(case, progress)
    return {
        "name": case.name,
        "told": said,
        "seconds": time.monotonic() - begun,
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": mark,
        "command": COMMAND,
    }


def waiting(only: list[str], shard: tuple[int, int], mark: str, *, again: bool) -> list[Case]:
    """A shard's cases that have no result yet, or none of this commit."""
    asked = [case for name, case in CASES.items() if not only or name in only]
    done = {e["name"] for e in stored() if not again or e["commit"] == mark}
    index, shards = shard
    return [case for case in asked[index::shards] if case.name not in done]


def go_through(cases: list[Case], path: Path, mark: str) -> None:
    """One after the other, with progress; each result is kept as soon as it is there."""
    with Progress(transient=True) as bars:
        whole = bars.add_task("cases", total=len(cases))
        for case in cases:
            one = bars.add_task(case.name, total=1.0)

            def hear(what: str, share: float, one: Any = one, name: str = case.name) -> None:
                bars.update(one, completed=share, description=f"{name}: {what}")

            entry = run(case, mark, hear)
            keep(path, entry)
            verdict, value = entry["told"]["verdict"], grade(case.truth, entry["told"])
            bars.console.print(f"{case.name}: {verdict}, {value}, {entry['seconds']:.0f} s")
            bars.remove_task(one)
            bars.advance(whole)


def main() -> int:
    """Run what is not there yet, and render; the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", default=[], choices=CASES, metavar="NAME")
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--again", action="store_true", help="also cases of another commit")
    parser.add_argument("--render", action="store_true", help="only the table of docs/shop.md")
    given = parser.parse_args()
    index, shards = map(int, given.shard.split("/"))
    mark, status = commit(), 0
    cases = waiting(given.only, (index, shards), mark, again=given.again)
    try:
        if not given.render:
            go_through(cases, path_of(index, shards), mark)
    except KeyboardInterrupt:
        status = 130
    render(stored())
    return status


if __name__ == "__main__":
    sys.exit(main())
