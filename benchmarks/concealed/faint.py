"""Single effects that physical bounds keep below E 100, in which nothing was found: their bounds.

The right answer is `ambiguous` there, or an upper bound.  ``python -m benchmarks.concealed.faint``
runs cases of that kind again that kept no bounds, which are development by now, and counts how
often the bound holds what was planted.  It goes on where it stopped.
"""

from __future__ import annotations

import argparse

import plant

from benchmarks.concealed.blind import load
from benchmarks.concealed.bounds import bounded
from benchmarks.concealed.calibration import rate
from benchmarks.concealed.distances import Entry, of
from benchmarks.concealed.proof import RESULTS, append, commit, in_time, outcomes, waiting
from benchmarks.concealed.score import score
from corexy_fmi.engine import diagnose

STEM, REACH = "faint", 100.0  # E below which physical bounds did not let an effect come
RUNS = ("full", "again", "seeds", "later", "newest")


def faint(entries: list[Entry]) -> list[Entry]:
    """The single effects below that."""
    return [e for e in of(entries, "effect") if e["truth"]["E"] < REACH]


def key(entry: Entry) -> str:
    """What a case is known by, whatever run it is of."""
    return f"{entry['name']}:{entry['seed']}"


def section(entries: list[Entry]) -> list[str]:
    """Lines of RESULTS.md on them: by verdict, and whether bounds held where nothing was found."""
    few = faint(entries)
    if not few:
        return []
    again = {e["name"]: e for e in outcomes(STEM)}
    missed = [e for e in few if e["outcome"] == "missed"]
    seen = [again.get(key(e), e) for e in missed]
    shown = [e for e in seen if e["outcome"] == "missed" and e.get("bounds")]
    later = sum(e["outcome"] != "missed" for e in seen)
    held = sum(row["holds"] for e in shown for row in e["bounds"])
    named = sum(e["outcome"] in ("right", "class") for e in few)
    return [
        f"Out of reach (inside physical bounds no size came to E {REACH:.0f}; the right answer is "
        f"`ambiguous` or an upper bound): {len(few)} single effects, of which named or in a class "
        f"{named}, left open otherwise {len(few) - named - len(missed)}, nothing missing "
        f"{len(missed)}. Of these, run again where no bounds had been kept (`python -m "
        f"benchmarks.concealed.faint`), {later} are found by now; the bound on what was planted "
        f"holds it in {rate(held, len(shown))}.",
        "",
    ]


def run(name: str, entry: Entry) -> Entry:
    """A stored case once more, with the bounds that it has now."""
    case = plant.draw(entry["seed"], **entry["wanted"])
    found = diagnose(*load(case), jobs=1).document
    told = {"outcome": score(found, case.truth), "bounds": bounded(found, case.truth)}
    return {"name": name, "truth": case.truth, "commit": commit()} | told


def unbounded() -> list[tuple[str, Entry]]:
    """The cases of all runs in which nothing was found, and of which no bounds were kept."""
    few = [e for stem in RUNS for e in faint(outcomes(stem))]
    return [(key(e), e) for e in few if e["outcome"] == "missed" and "bounds" not in e]


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    given = parser.parse_args()
    out = RESULTS / f"{STEM}.jsonl"
    left, out = waiting(unbounded(), given.shard, out, lambda entry: True)
    for name, entry in in_time(left, given.minutes, "bounds"):
        append(out, run(name, entry))


if __name__ == "__main__":
    main()
