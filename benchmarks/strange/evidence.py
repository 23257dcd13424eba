"""E of each concealed cause: what of it stays when the machine's numbers are fitted without it.

    python -m benchmarks.strange.evidence [--shard i/n] [--two]

E is the least sum of squares, over the noise of the recordings to fit (whitened, means removed
where the zero is unknown), of the noise-free recordings minus those of the same simulator without
the cause, over all unsure numbers of the machine and the sizes of the other cause, without priors:
the definition of the blind proof (RESULTS.md), here linear about the truth.  It knows nothing of
the engine.  Each case is drawn anew; its line of benchmarks/results/evidence.strange.jsonl (of
evidence.i.strange.jsonl with --shard) has E in the order of the causes.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from pathlib import Path

import numpy as np
from rich.progress import track

from benchmarks.shop.case import TRAIN
from benchmarks.shop.stage import Array
from benchmarks.shop.store import Entry, commit, keep
from benchmarks.strange.draw import LOOPS, Drawn, draw
from benchmarks.strange.machines import MOTORS, UNSURE
from benchmarks.strange.running import HEALTHY, Acts, all_moved, both
from benchmarks.strange.sizes import Sized
from benchmarks.strange.store import evidence_path, evidences, stored

SMALL = 0.01  # of a number or a size, for its derivative
COARSER = 0.25  # of a step's inverse where a loose pulley takes an eighth of it
INDEPENDENT = 1e-4  # of the largest singular value, below which no number is told from the others


def _seen(case: Drawn, acts: Acts, numbers: dict[str, float]) -> list[Array]:
    """Places [m] of the samples of the recordings to fit, without noise."""
    machine = replace(case.machine, numbers=dict(case.machine.numbers) | numbers)
    finer = COARSER if acts.loose else 1.0
    moved = all_moved(machine, case.motions[: len(TRAIN)], acts, finer)
    return [xy[:: case.sensor.every] for xy in moved]


def _acts(found: Sequence[Sized]) -> Acts:
    return reduce(both, [one.acts for one in found]) if found else HEALTHY


def _larger(found: Sequence[Sized], which: int) -> list[Sized]:
    """The causes, one of them a little larger."""
    return [replace(s, size=s.size * (1 + SMALL * (n == which))) for n, s in enumerate(found)]


def evidence(case: Drawn) -> list[float]:
    """E of each cause of a case."""
    found = list(case.found)
    numbers, truth = dict(case.machine.numbers), _seen(case, _acts(found), {})

    def change(seen: Sequence[Array]) -> Array:
        pairs = zip(seen, truth, strict=True)
        return np.concatenate([case.sensor.whitened(a - b).ravel() for a, b in pairs])

    unsure = UNSURE | MOTORS if case.machine.dc else UNSURE
    slopes = [change(_seen(case, _acts(found), {n: numbers[n] * (1 + SMALL)})) for n in unsure]
    sizes = {
        n: change(_seen(case, _acts(_larger(found, n)), {}))
        for n, one in enumerate(found)
        if len(found) > 1 and not one.cause.whole
    }
    least = []
    for n in range(len(found)):
        without = change(_seen(case, _acts(found[:n] + found[n + 1 :]), {}))
        columns = np.column_stack([*slopes, *(s for k, s in sizes.items() if k != n)])
        least.append(left(without, columns))
    return least


def left(change: Array, columns: Array) -> float:
    """Squares of a change that no sum of columns, each of them scaled to one, takes away."""
    sizes = np.linalg.norm(columns, axis=0)
    turn, power, _ = np.linalg.svd(columns[:, sizes > 0] / sizes[sizes > 0], full_matrices=False)
    own = turn[:, power > INDEPENDENT * power.max(initial=0.0)]
    return float(change @ change - (own.T @ change) @ (own.T @ change))


def go_through(entries: Sequence[Entry], path: Path) -> None:
    """One after the other; each result is kept as soon as it is there."""
    mark = commit()
    for entry in track(entries, "cases", transient=True):
        case = draw(entry["seed"], "effects" in entry["truth"], entry["number"] >= LOOPS)
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
    go_through(asked[index::shards], evidence_path(index, shards))


if __name__ == "__main__":
    main()
