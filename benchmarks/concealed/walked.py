"""Do intervals hold the truth once they are walked along the likelihood?

    python -m benchmarks.concealed.walked [--shard i/n] [--minutes M]

Rightly named cases of the proof whose law the catalogue has, and whose interval of a parameter on a
logarithmic scale is wide, are drawn again, and the true effect is fitted from what was found
(`loose.py`).  Appends to results/walked.jsonl, where it goes on; ``--render`` tells how many
intervals hold the truth as the curvature tells, with looser priors, and walked, and how much wider
they are.
"""

from __future__ import annotations

import argparse
import time
from hashlib import sha256
from typing import Any

import numpy as np
from rich.progress import track
from threadpoolctl import threadpool_limits

from benchmarks.concealed.calibration import as_catalogued, in_own_form, inside_of, single
from benchmarks.concealed.loose import fitted
from benchmarks.concealed.proof import RESULTS, append, commit, read
from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.looser import loosened
from corexy_fmi.engine.model import covariance, effect_table, ends
from corexy_fmi.engine.walked import WIDE, walked

STORE = RESULTS / "walked.jsonl"
Entry = dict[str, Any]


def chosen() -> list[Entry]:
    """Rightly named cases in the catalogue's form, an interval of which is wide, in an order of no
    meaning, so that some of them are a fair sample.
    """
    entries = [e for path in sorted(RESULTS.glob("full.?.jsonl")) for e in read(path)]
    own = [e for e in single(entries) if e["outcome"] == "right" and in_own_form(e)]
    found = [e for e in own if any(map(wide, *_known(e)))]
    return sorted(found, key=lambda e: sha256(e["name"].encode()).hexdigest())


def _known(entry: Entry) -> tuple[list[Parameter], list[Any]]:
    """Parameters on a logarithmic scale, and what was said of them."""
    (said,) = entry["document"]["effects"]
    known = [
        p for p in catalogue()[said["name"]].parameters if p.log and p.name in said["parameters"]
    ]
    return known, [said["parameters"][p.name]["ci95"] for p in known]


def wide(parameter: Parameter, reached: list[float]) -> bool:
    """Whether an interval is walked: wide, and ending within what the catalogue allows."""
    low, high = reached
    inside = low > parameter.lower or high < parameter.upper
    return inside and (low <= 0 or np.log(high / low) > 2 * WIDE)


def asked(entry: Entry) -> Entry:
    """For each parameter whose interval was walked whether it holds the truth by curvature, under
    looser priors, and walked, its width in each, and how long that took [s].
    """
    fit, (planted,) = fitted(entry), entry["truth"]["effects"]
    (said,) = entry["document"]["effects"]
    key, spread = (said["name"], said["location"]), covariance(fit)
    loose, begun = [ends(loosened(fit))], time.process_time()
    reached = walked(fit, map)
    taken = time.process_time() - begun
    tables = [effect_table(fit, *key, spread, f) for f in ([], loose, [*loose, reached])]
    rows = []
    for name in (n for n in tables[0] if n in planted["parameters"]):
        if f"{key[0]}.{key[1]}.{name}" in reached:
            truth = as_catalogued(planted["name"], name, planted["parameters"][name])
            rows.append(
                {
                    "parameter": name,
                    "inside": [bool(inside_of(name, table[name], truth)) for table in tables],
                    "width": [float(np.ptp(np.log(table[name]["ci95"]))) for table in tables],
                }
            )
    return {"name": entry["name"], "wide": WIDE, "taken": taken, "rows": rows, "commit": commit()}


def told(entries: list[Entry]) -> str:
    """A line of what came out."""
    rows = [row for e in entries for row in e["rows"]]
    held = [sum(row["inside"][k] for row in rows) for k in range(3)]
    wider = [np.exp(row["width"][2] - row["width"][1]) for row in rows]
    taken = np.median([e["taken"] for e in entries if e["rows"]])
    return (
        f"{len(entries)} cases, {len(rows)} parameters walked: inside {held[0]} by curvature, "
        f"{held[1]} with looser priors, {held[2]} walked too; from end to end further by a factor "
        f"of {np.median(wider):.2f} in the median, {np.quantile(wider, 0.9):.2f} in the widest "
        f"tenth; {taken:.1f} s of CPU in the median"
    )


def main() -> None:
    """Ask the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    parser.add_argument("--render", action="store_true", help="only tell what came out")
    arguments = parser.parse_args()
    index, shards = map(int, arguments.shard.split("/"))
    done, begun_at = {e["name"] for e in read(STORE)}, time.monotonic()
    waiting = [] if arguments.render else [e for e in chosen() if e["name"] not in done]
    with threadpool_limits(1):
        for entry in track(waiting[index::shards], description="cases"):
            if time.monotonic() - begun_at > 60 * arguments.minutes:
                break
            append(STORE, asked(entry))
    print(told(read(STORE)))


if __name__ == "__main__":
    main()
