"""The score of `make blind` over its seeds: drawn and diagnosed as there, without the controls.

``python -m benchmarks.concealed.seeds [--round NAME] [--shard i/n] [--minutes M]`` goes on where it
stopped: with seeds 0 to 199, or with those of a later round, begun when the one before was done.
The plant draws one of 35 effects, a pair, nothing or a cause outside its catalogue; all effects
compete.
"""

from __future__ import annotations

import argparse
from collections import Counter
from typing import Any

from benchmarks.concealed import faint
from benchmarks.concealed.calibration import rate
from benchmarks.concealed.calibration import section as trusted
from benchmarks.concealed.distances import overstated, removal
from benchmarks.concealed.proof import (
    RESULTS,
    append,
    in_time,
    outcomes,
    run_sealed,
    seals,
    waiting,
)
from benchmarks.concealed.score import fulfilled
from benchmarks.concealed.tables import FULL_AIMS, ONCE, by, headline

FIRST, LATER, NEWEST = "seeds", "later", "newest"  # rounds, and their files' names
SEEDS = {FIRST: range(200), LATER: range(200, 300), NEWEST: range(300, 400)}


def every() -> list[dict[str, Any]]:
    """Outcomes of all rounds."""
    return [entry for part in SEEDS for entry in outcomes(part)]


def section(part: str = FIRST) -> list[str]:
    """Lines of RESULTS.md on a round."""
    entries, which = outcomes(part), _span(part)
    if not entries:
        return []
    commits = ", ".join(sorted({e["commit"][:12] for e in entries}))
    once = ONCE if len({e["commit"] for e in entries}) > 1 else ""
    said = Counter(f"{e['truth']['kind']} {e['outcome']}" for e in entries)
    asked, false = rates(entries)
    return [
        f"## Seeds {which} of `make blind`",
        "",
        f"`python -m benchmarks.concealed.seeds{'' if part == FIRST else f' --round {part}'}` "
        f"at commit {commits}, {len(entries)} run so far; all 35 effects compete. {once}".rstrip(),
        "",
        f"As asked (right, or a class with the truth where a twin is near): {asked}; wrong and "
        f"confident, or a false alarm: {false}. Seals without an outcome of their own, ended "
        "before one by hand for another engine or by the clock, to be begun anew: "
        f"{len(seals(part)) - len(entries)}."
        + (_newest(entries) if once and part != FIRST else ""),
        "",
        "; ".join(f"{kind} {n}" for kind, n in sorted(said.items())) + ".",
        "",
        "A pair is asked for whole here, however faint one of it is; the plant draws E of 150, "
        "300, 1000 or 5000. Against the aims:",
        "",
        *headline(entries, FULL_AIMS),
        "",
        *faint.section(entries),
        *removal(entries),
        *overstated(entries),
        *trusted(entries),
        *by(entries, "effect"),
        "",
    ]


def rates(entries: list[dict[str, Any]]) -> tuple[str, str]:
    """How many are as asked, and wrong with confidence or a false alarm."""
    met = sum(fulfilled(e["outcome"], e["truth"]) for e in entries)
    confident = sum(e["outcome"] in ("wrong", "false_alarm") for e in entries)
    return rate(met, len(entries)), rate(confident, len(entries))


def _span(part: str) -> str:
    return f"{SEEDS[part][0]} to {SEEDS[part][-1]}"


def sentence() -> str:
    """What README.md says of them; nothing where none was run."""
    first = outcomes(FIRST)
    if not first:
        return ""
    asked, false = rates(first)
    told = (
        f"Over {len(first)} of its seeds {_span(FIRST)}, run in their order, faint causes "
        f"(E of 150) and pairs among them: as asked {asked}, wrong and confident or a false alarm "
        f"{false} (Wilson 95 %)."
    )
    later = {part: entries for part in SEEDS if part != FIRST and (entries := outcomes(part))}
    if not later:
        return told
    return f"{told} That was by engines of many days, mended by what they missed." + "".join(
        _after(part, entries, part == list(later)[-1]) for part, entries in later.items()
    )


def _after(part: str, entries: list[dict[str, Any]], last: bool) -> str:
    """What README.md says of a round after the first; of the last one, also of its last engine."""
    asked, false = rates(entries)
    one = len({e["commit"] for e in entries}) == 1
    return (
        f" Over {len(entries)} of the seeds {_span(part)}, by "
        f"{'one engine' if one else 'engines after those'}: as asked {asked}, wrong or a false "
        f"alarm {false}." + (_newest(entries) if last and not one else "")
    )


def _newest(entries: list[dict[str, Any]]) -> str:
    """What is said of the seeds that the engine of the last of them ran."""
    last = max(entries, key=lambda e: int(e["name"].rpartition("-")[2]))
    own = [e for e in entries if e["commit"] == last["commit"]]
    asked, false = rates(own)
    return (
        f" Of these, the last {len(own)}, by one engine: as asked {asked}, wrong or a false alarm "
        f"{false}."
    )


def main() -> None:
    """Run the seeds that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th seed, from i")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    spans = ", ".join(f"{part}: {_span(part)}" for part in SEEDS)
    parser.add_argument("--round", choices=SEEDS, default=FIRST, help=f"which seeds ({spans})")
    given = parser.parse_args()
    part = given.round
    asked = [(f"seed-{n}", {"catalogue": "full"}) for n in SEEDS[part]]
    cases, out = waiting(asked, given.shard, RESULTS / f"{part}.jsonl", lambda entry: True)
    for name, wanted in in_time(cases, given.minutes, "blind seeds"):
        seed, sealed = int(name.rpartition("-")[2]), out.with_suffix(".seals.jsonl")
        entry, *_ = run_sealed(name, seed, wanted, frozenset(), sealed)
        append(out, entry)


if __name__ == "__main__":
    main()
