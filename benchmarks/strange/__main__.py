"""Diagnoses of machines that nobody developed on, with a concealed cause or none.

    python -m benchmarks.strange [--count 60] [--two 0] [--dc 0] [--rest 0] [--dc-two 0]
                                [--shard i/n] [--origin HASH]
    python -m benchmarks.strange --render
    python -m benchmarks.strange --write N FOLDER [--origin HASH]

Each case is drawn from the origin and its number, written as files, sealed by hash, diagnosed and
graded; its result is a line of benchmarks/results/strange.jsonl (of strange.i.jsonl with --shard),
and docs/strange.md's table is rendered from all of them.  Cases that have a result of this origin
are skipped.  Ctrl-C loses only the case that runs.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.progress import Progress

from benchmarks import outcome
from benchmarks.concealed.cases import seed_of
from benchmarks.shop.ask import Hears, ask
from benchmarks.shop.store import Entry, commit, keep
from benchmarks.strange.draw import LOOPED_PAIRS, LOOPS, OTHERS, PAIRS, Drawn, drawn
from benchmarks.strange.files import MACHINE, seal, write
from benchmarks.strange.page import marked, named, render
from benchmarks.strange.store import SEALS, path_of, stored, waiting


def told(case: Drawn, head: Entry, path: Path, hears: Hears) -> tuple[dict[str, Any], str, float]:
    """What the engine says of a case that was sealed before; the seal; how long it took [s]."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(case, folder)
        sealed = seal(case, folder)
        keep(path.with_suffix(SEALS), head | {"seal": sealed})
        begun = time.monotonic()
        said = ask(folder, folder / MACHINE, hears)
        return said, sealed, time.monotonic() - begun


def run(number: int, origin: str, mark: str, path: Path, hears: Hears) -> Entry:
    """A case's line of results."""
    seed = seed_of(origin, str(number))
    case = drawn(number, seed)
    head = {"name": f"{origin}-{number}", "number": number, "origin": origin, "seed": seed}
    said, sealed, seconds = told(case, head, path, hears)
    return head | {
        "truth": case.truth,
        "told": said,
        "verdict": said["verdict"],
        "named": named(said),
        "place": said["coordinate"],
        "grade": marked(case.truth, said),
        "seal": sealed,
        "seconds": seconds,
        "recorded": float(sum(time[-1] - time[0] for time, _ in case.motions)),
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": mark,
    }


def go_through(numbers: Sequence[int], origin: str, path: Path) -> None:
    """One after the other, with progress; each result is kept as soon as it is there."""
    mark = commit()
    with Progress(transient=True) as bars:
        whole = bars.add_task("cases", total=len(numbers))
        for number in numbers:
            one = bars.add_task(f"{number}: drawn", total=1.0)

            def hear(what: str, share: float, one: Any = one, number: int = number) -> None:
                bars.update(one, completed=share, description=f"{number}: {what}")

            entry = run(number, origin, mark, path, hear)
            keep(path, entry)
            words = f"{entry['verdict']}, {entry['grade']}, {entry['seconds']:.0f} s"
            bars.console.print(f"{number}: {words}")
            bars.remove_task(one)
            bars.advance(whole)


def show(number: int, origin: str, folder: Path) -> None:
    """A case's files, and its truth beside them."""
    case = drawn(number, seed_of(origin, str(number)))
    write(case, folder)
    text = json.dumps(case.truth | {"numbers": case.machine.numbers}, indent=1)
    (folder / "truth.json").write_text(text + "\n", encoding="utf-8")


def main() -> int:
    """Run what is not there yet, and render; the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=60, help="cases, from number 0")
    parser.add_argument("--two", type=int, default=0,
                        help=f"cases of two causes, from number {PAIRS}")  # fmt: skip
    parser.add_argument("--dc", type=int, default=0,
                        help=f"cases with dc motors, from number {LOOPS}")  # fmt: skip
    parser.add_argument("--rest", type=int, default=0,
                        help=f"cases of the other causes, from number {OTHERS}")  # fmt: skip
    parser.add_argument("--dc-two", type=int, default=0,
                        help=f"of two causes with dc, from number {LOOPED_PAIRS}")  # fmt: skip
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--origin", default=outcome.commit().rstrip("+"), metavar="HASH",
                        help="what the seeds follow from; default: this commit")  # fmt: skip
    parser.add_argument("--render", action="store_true", help="only the table of docs/strange.md")
    parser.add_argument("--write", nargs=2, metavar=("N", "FOLDER"), help="only a case's files")
    given = parser.parse_args()
    firsts = {"count": 0, "two": PAIRS, "dc": LOOPS, "rest": OTHERS, "dc_two": LOOPED_PAIRS}
    counts = {name: getattr(given, name) for name in firsts}
    for name, count in counts.items():
        if count > PAIRS:
            option = name.replace("_", "-")
            parser.error(f"--{option}: found {count}, expected at most {PAIRS}")
    if given.write:
        show(int(given.write[0]), given.origin, Path(given.write[1]))
        return 0
    index, shards = map(int, given.shard.split("/"))
    status = 0
    try:
        if not given.render:
            asked = [firsts[name] + k for name, count in counts.items() for k in range(count)]
            numbers = waiting(asked[index::shards], given.origin)
            go_through(numbers, given.origin, path_of(index, shards))
    except KeyboardInterrupt:
        status = 130
    render(stored())
    return status


if __name__ == "__main__":
    sys.exit(main())
