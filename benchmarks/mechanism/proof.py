"""Sealed cases whose cause is a mechanism in MuJoCo: drawn, sealed, diagnosed blind, opened.

``python -m benchmarks.mechanism.proof [--origin COMMIT] [--repeats N] [--minutes M]`` goes on where
it stopped.  All 35 effects compete.  Seeds follow from the hash of a commit; a seal is kept before
the diagnosis begins, nothing is dropped.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import plant

from benchmarks.concealed.blind import load
from benchmarks.concealed.cases import seed_of
from benchmarks.concealed.proof import commit, kept_of
from benchmarks.concealed.score import score
from benchmarks.mechanism.draw import draw
from benchmarks.mechanism.mechanisms import MECHANISMS
from benchmarks.mechanism.store import append, read
from corexy_fmi.engine import diagnose

NULLS = 3  # in each turn


def planned(repeats: int) -> list[tuple[str, str | None]]:
    """Names and mechanisms: each mechanism once, three nulls, and again."""
    cases: list[tuple[str, str | None]] = []
    for n in range(repeats):
        cases += [(f"{m}-{n}", m) for m in MECHANISMS]
        cases += [(f"null-{k}", None) for k in range(NULLS * n, NULLS * (n + 1))]
    return cases


def run_case(name: str, mechanism: str | None, origin: str) -> dict[str, Any]:
    """Draw, seal, diagnose, open, score."""
    seed, begun = seed_of(origin, name), time.monotonic()
    case = draw(seed, mechanism)
    seal, _ = plant.seal(case)
    append("seals", {"name": name, "origin": origin, "seal": seal})
    drawn = time.monotonic()
    train, holdout, machine = load(case)
    found = diagnose(train, holdout, machine, jobs=2)
    return {
        "name": name,
        "origin": origin,
        "seed": seed,
        "truth": case.truth,
        "seal": seal,
        "seconds": {
            "draw": drawn - begun,
            "diagnose": time.monotonic() - drawn,
            "recorded": float(sum(r.time[-1] - r.time[0] for r in train)),
        },
        "outcome": score(found.document, case.truth),
        "document": kept_of(found),
        "nearest": found.document["nearest"],
        "commit": commit(),
        "command": f"python -m benchmarks.mechanism.proof --origin {origin}",
    }


def told(entry: dict[str, Any]) -> str:
    """One case in a line."""
    said, held = entry["document"], entry["document"]["heldout"]
    named = " + ".join(f"{e['name']} at {e['location']}" for e in said["effects"]) or "-"
    rms = "/".join(
        f"{1e6 * (held[k] or 0):.1f}"
        for k in ("rms_nominal", "rms_retuned", "rms_explained", "noise_std")
    )
    return (
        f"{entry['name']:12s} {entry['truth']['size']:22s} {entry['outcome']:12s}"
        f" {said['verdict']}: {named}; held out {rms} um; {entry['seconds']['diagnose']:.0f} s"
    )


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--origin", default=commit(), help="what the seeds follow from")
    parser.add_argument("--repeats", type=int, default=2, help="cases of each mechanism")
    parser.add_argument("--names", nargs="*", help="only these; default: all")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    arguments, begun = parser.parse_args(), time.monotonic()
    for name, mechanism in planned(arguments.repeats):
        done = {e["name"] for e in read().get("cases", []) if e["origin"] == arguments.origin}
        if name in done or (arguments.names and name not in arguments.names):
            continue
        if time.monotonic() - begun > 60 * arguments.minutes:
            continue
        entry = run_case(name, mechanism, arguments.origin)
        append("cases", entry)
        print(told(entry), flush=True)


if __name__ == "__main__":
    main()
