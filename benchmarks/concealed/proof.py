"""The published proof: many sealed cases, resumable and sharded (`make proof`).

Each case appends its seal before it is diagnosed and its outcome after; nothing is dropped.  The
seeds follow from the hash of a commit, so that the author chooses none of them.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import plant
from rich.progress import track

from benchmarks.concealed.blind import Given, load
from benchmarks.concealed.bounds import bounded
from benchmarks.concealed.cases import CATALOGUES, published, seed_of, strikes
from benchmarks.concealed.curve import curve_error
from benchmarks.concealed.held import kept_back, reached, removed
from benchmarks.concealed.score import score
from corexy_fmi.effects import catalogue
from corexy_fmi.engine import Diagnosis, diagnose

RESULTS = Path("benchmarks/results")
OUT = {"ten": "proof.jsonl", "full": "full.jsonl"}
KEPT = ("verdict", "ambiguous_between", "ambiguous_sets", "heldout")


def commit() -> str:
    """Hash of the commit that runs."""
    done = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def append(path: Path, entry: dict[str, Any]) -> None:
    """One line more in a results file."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry, sort_keys=True) + "\n")


def read(path: Path) -> list[dict[str, Any]]:
    """Entries of a results file; an unfinished last line is left out."""
    if not path.exists():
        return []
    entries = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            entries.append(json.loads(line))
        except ValueError:
            continue
    return entries


def outcomes(stem: str) -> list[dict[str, Any]]:
    """All outcomes of a run, whatever its shards."""
    paths = sorted(p for p in RESULTS.glob(f"{stem}*.jsonl") if "seals" not in p.name)
    return [entry for path in paths for entry in read(path)]


def seals(stem: str) -> list[dict[str, Any]]:
    """All seals of a run, whatever its shards."""
    return [seal for path in RESULTS.glob(f"{stem}*.seals.jsonl") for seal in read(path)]


def kept_of(found: Diagnosis) -> dict[str, Any]:
    """What is kept of a diagnosis."""
    document = found.document
    kept = {k: document[k] for k in KEPT}
    kept["gain"] = max((r.gain for r in found.evidence.runners_up), default=0.0)
    rows = [r.gain for r in found.evidence.runners_up if r.name != "retuned_parameters"]
    kept["best"] = max(rows, default=None)  # of all that was fitted, below 0 too
    kept["leftover"] = found.evidence.leftover
    kept["located"] = {k: document["located"][k] for k in ("coordinate", "state")}
    kept["effects"] = [
        {k: e[k] for k in ("name", "location", "probability", "parameters")}
        for e in document["effects"]
    ]
    return kept


def struck(case: Any, found: Diagnosis) -> dict[str, Any]:
    """Level L4: what is said where the true entry is deleted, and how far its law is off."""
    document = found.document
    return kept_of(found) | {
        "verdict": document["verdict"],
        "effects": [(e["name"], e["location"]) for e in document["effects"]],
        "coordinate": document["located"]["coordinate"],
        "curve_error": curve_error(case, document),
        "reached": reached(case, found)["explained"],
    }


Case = tuple[str, dict[str, Any]]  # name, what is wanted of the plant


def run_sealed(
    name: str, seed: int, wanted: dict[str, Any], without: frozenset[str], seals: Path
) -> tuple[dict[str, Any], Any, Given, Diagnosis]:
    """Draw, seal, diagnose, open, score: what is kept, the case, what the engine was given, and
    what it said.
    """
    begun = time.monotonic()
    case = plant.draw(seed, **wanted)
    seal, _ = plant.seal(case)
    append(seals, {"name": name, "seed": seed, "seal": seal})
    drawn = time.monotonic()
    given = load(case)
    found = diagnose(*given, jobs=1, without=without)
    seconds = {
        "draw": drawn - begun,
        "diagnose": time.monotonic() - drawn,
        "recorded": float(sum(r.time[-1] - r.time[0] for r in given[0])),
    }
    entry = {
        "name": name,
        "seed": seed,
        "wanted": wanted,
        "truth": case.truth,
        "zeroed": case.world.zeroed,  # whether x, y have the inputs' zero
        "seal": seal,
        "seconds": seconds,
        "outcome": score(found.document, case.truth),
        "document": kept_of(found),
        "removed": removed(case, found),
        "reached": reached(case, found),
        "kept_back": kept_back(case, found),
        "bounds": bounded(found.document, case.truth),
        "commit": commit(),
    }
    return entry, case, given, found


def run_case(name: str, wanted: dict[str, Any], origin: str, seals: Path) -> dict[str, Any]:
    """One published case; every fourth of an effect once more with its true entry struck."""
    drawn_from = CATALOGUES[wanted.get("catalogue", "ten")]
    unknown = frozenset(catalogue()) - set(drawn_from)  # what this draw of the plant lacks
    entry, case, given, _ = run_sealed(name, seed_of(origin, name), wanted, unknown, seals)
    if strikes(name):
        without = unknown | {e["name"] for e in case.truth["effects"]}
        entry["struck"] = struck(case, diagnose(*given, jobs=1, without=without))
    return entry


def waiting(
    cases: list[Case], shard: str, out: Path, counts: Callable[[dict[str, Any]], bool]
) -> tuple[list[Case], Path]:
    """A shard's cases that its file lacks, and that file; ``counts``: is an entry of this run?"""
    index, shards = map(int, shard.split("/"))
    out = out.with_suffix(f".{index}.jsonl") if shards > 1 else out
    out.parent.mkdir(parents=True, exist_ok=True)
    done = {entry["name"] for entry in read(out) if counts(entry)}
    return [case for case in cases[index::shards] if case[0] not in done], out


def in_time(cases: list[Case], minutes: float, what: str) -> Iterator[Case]:
    """The cases one by one, with progress; none is begun after so many minutes."""
    begun = time.monotonic()
    for case in track(cases, description=what):
        if time.monotonic() - begun > 60 * minutes:
            return
        yield case


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--origin", default=commit(), help="what the seeds follow from; default: this commit"
    )
    parser.add_argument("--effects", type=int, default=20, help="cases for each effect")
    parser.add_argument("--nulls", type=int, default=300)
    parser.add_argument(
        "--others", type=int, default=30, help="pairs, and causes outside the catalogue"
    )
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    parser.add_argument(
        "--catalogue", choices=CATALOGUES, default="ten", help="the plant's: ten effects or all 35"
    )
    parser.add_argument("--out", type=Path, help="default: results/proof.jsonl, full.jsonl of all")
    arguments = parser.parse_args()
    arguments.out = arguments.out or RESULTS / OUT[arguments.catalogue]
    counts = (arguments.effects, arguments.nulls, arguments.others)
    cases, out = waiting(
        published(*counts, arguments.catalogue),
        arguments.shard,
        arguments.out,
        lambda entry: entry.get("origin") == arguments.origin,
    )
    for name, wanted in in_time(cases, arguments.minutes, "blind cases"):
        entry = run_case(name, wanted, arguments.origin, out.with_suffix(".seals.jsonl"))
        append(out, entry | {"origin": arguments.origin})


if __name__ == "__main__":
    main()
