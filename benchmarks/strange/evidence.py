"""E of each concealed cause: what of it stays when the machine's numbers are fitted without it.

    python -m benchmarks.strange.evidence [--shard i/n] [--two]

E is the least sum of squares, over the noise of the recordings to fit (whitened, means removed
where the zero is unknown), of the noise-free recordings minus those of the same simulator without
the cause, over all unsure numbers of the machine and the size of the other cause: the definition of
the blind proof (RESULTS.md), here linear about the true numbers, within a factor of about e, where
that has no priors.  It knows nothing of the engine.  Each case is drawn anew; its line of
benchmarks/results/evidence.strange.jsonl (of evidence.i.strange.jsonl with --shard) has E in the
order of the causes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.progress import track

from benchmarks.shop.case import TRAIN
from benchmarks.shop.stage import Array
from benchmarks.shop.store import Entry, commit, keep
from benchmarks.strange.draw import Drawn, acts_of, drawn
from benchmarks.strange.machines import MOTORS, UNSURE
from benchmarks.strange.running import Acts, all_moved
from benchmarks.strange.sizes import Sized
from benchmarks.strange.store import evidence_path, evidences, stored

SMALL = 0.01  # of a number or a size, for its derivative
COARSER = 0.25  # of a step's inverse where a loose pulley takes an eighth of it
LOOSE = 1.0  # standard deviation of a number's logarithm: a linear view holds no farther


def _seen(case: Drawn, acts: Acts, numbers: dict[str, float]) -> list[Array]:
    """Places [m] of the samples of the recordings to fit, without noise."""
    machine = replace(case.machine, numbers=dict(case.machine.numbers) | numbers)
    finer = COARSER if acts.loose else 1.0
    moved = all_moved(machine, case.motions[: len(TRAIN)], acts, finer)
    return [xy[:: case.sensor.every] for xy in moved]


def _larger(found: Sequence[Sized], which: int) -> list[Sized]:
    """The causes, one of them a little larger."""
    return [replace(s, size=s.size * (1 + SMALL * (n == which))) for n, s in enumerate(found)]


def evidence(case: Drawn) -> list[float]:
    """E of each cause of a case."""
    truth = _seen(case, acts_of(case.found), {})
    each = range(len(case.found))
    return [_evidence(case, case.found[:n] + case.found[n + 1 :], truth) for n in each]


def _evidence(case: Drawn, others: Sequence[Sized], truth: Sequence[Array]) -> float:
    """Squares of what the others and all numbers leave of what is true [1]."""
    numbers = case.machine.numbers
    unsure = UNSURE | MOTORS if case.machine.dc else UNSURE

    def change(seen: Sequence[Array], of: Sequence[Array]) -> Array:
        pairs = zip(seen, of, strict=True)
        return np.concatenate([case.sensor.whitened(a - b).ravel() for a, b in pairs])

    stays = acts_of(others) if others else case.found[0].cause.without
    without = _seen(case, stays, {})
    moved = [_seen(case, stays, {n: numbers[n] * (1 + SMALL)}) for n in unsure]
    sized = [n for n, one in enumerate(others) if not one.cause.whole]
    moved += [_seen(case, acts_of(_larger(others, n)), {}) for n in sized]
    return left(change(truth, without), np.column_stack([change(m, without) for m in moved]))


def left(change: Array, columns: Array) -> float:
    """The least squares of a change minus what numbers may do, each told as loosely as `LOOSE`."""
    held = SMALL / LOOSE * np.eye(columns.shape[1])
    both = np.vstack([columns, held]), np.concatenate([change, np.zeros(len(held))])
    found = np.linalg.lstsq(*both, rcond=None)[0]
    return float(((both[1] - both[0] @ found) ** 2).sum())


def go_through(entries: Sequence[Entry], path: Path) -> None:
    """One after the other; each result is kept as soon as it is there."""
    mark = commit()
    for entry in track(entries, "cases", transient=True):
        case = drawn(entry["number"], entry["seed"])
        if case.truth != entry["truth"]:
            raise SystemExit(f"{entry['name']}: not the case that was diagnosed")
        line = {"name": entry["name"], "E": evidence(case), "commit": mark}
        keep(path, line)


def main() -> None:
    """Those cases with a cause that have no E yet."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--two", action="store_true", help="only cases of two causes")
    given = parser.parse_args()
    index, shards = map(int, given.shard.split("/"))
    done = evidences()
    waiting = [e for e in stored() if e["truth"]["effect"] and e["name"] not in done]
    asked = [e for e in waiting if "effects" in e["truth"] or not given.two]
    asked.sort(key=lambda e: e["grade"] == "right")  # the others are what is asked about
    go_through(asked[index::shards], evidence_path(index, shards))


if __name__ == "__main__":
    main()
