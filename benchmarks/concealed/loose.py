"""Do intervals hold the truth once the machine file's priors are loosened?

    python -m benchmarks.concealed.loose [--shard i/n] [--minutes M]

Rightly named cases of the proof whose law the catalogue has are drawn again, and the true effect is
fitted from what was found, under the file's priors and under looser ones.  Those whose interval had
missed come first, then as many others.  Appends to results/loose.jsonl, where it goes on;
``--render`` tells how many intervals hold the truth, and how much wider they are.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import Any

import numpy as np
import plant
from rich.progress import track
from threadpoolctl import threadpool_limits

from benchmarks.concealed.blind import load
from benchmarks.concealed.calibration import as_catalogued, coverage, in_own_form, inside_of, single
from benchmarks.concealed.proof import RESULTS, append, commit, read
from corexy_fmi.engine.data.excerpts import excerpts
from corexy_fmi.engine.data.given import make_runs, preflight
from corexy_fmi.engine.fitting.fit import Fit, minimise, settle
from corexy_fmi.engine.fitting.looser import LOOSE, loosened
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import covariance, effect_table, ends
from corexy_fmi.engine.judging.moving import begun
from corexy_fmi.kernel.layout import bundled_layout

STORE = RESULTS / "loose.jsonl"
Entry = dict[str, Any]


def chosen() -> list[Entry]:
    """Rightly named cases in the catalogue's form: those that missed first, then as many others."""
    entries = [e for path in sorted(RESULTS.glob("full.?.jsonl")) for e in read(path)]
    own = [e for e in single(entries) if e["outcome"] == "right" and in_own_form(e)]
    missed = [e for e in own if not all(all(v) for v in coverage([e]).values())]
    return missed + [e for e in own if e not in missed][: len(missed)]


def fitted(entry: Entry) -> Fit:
    """The named effect fitted to its case once more, from what was found."""
    case, layout = plant.draw(entry["seed"], **entry["wanted"]), bundled_layout()
    train, _, machine = load(case)[:3]
    runs = begun(make_runs(preflight(train, machine)[0], [], machine)[0], layout, machine)
    base = retune(layout, machine, tuple(excerpts(runs)))
    (said,) = entry["document"]["effects"]
    instance = layout.find(said["name"], said["location"])
    problem = replace(base.problem, hypothesis=Hypothesis((instance,)))
    start, before = problem.carried(base.problem, base.u), f"{said['name']}.{said['location']}."
    for k, unknown in enumerate(problem.unknowns):
        known = said["parameters"].get(unknown.key.removeprefix(before))
        if known and unknown.key.startswith(before):
            start[k] = unknown.internal(known["value"])
    return settle(minimise(problem, start, 20), 2, 8)


def asked(entry: Entry) -> Entry:
    """For each parameter whether its interval holds the truth, with the file's priors and looser
    ones, and by how much it widens.
    """
    fit, (planted,) = fitted(entry), entry["truth"]["effects"]
    (said,) = entry["document"]["effects"]
    key, spread = (said["name"], said["location"]), covariance(fit)
    loose = [ends(wide)] if (wide := loosened(fit)) else []
    tables = [effect_table(fit, *key, spread, further) for further in ([], loose)]
    rows = []
    for name in (n for n in tables[0] if n in planted["parameters"]):
        truth = as_catalogued(planted, name, tables[0])
        widths = [float(np.ptp(table[name]["ci95"])) for table in tables]
        rows.append(
            {
                "parameter": name,
                "inside": [bool(inside_of(name, table[name], truth)) for table in tables],
                "wider": widths[1] / widths[0] if widths[0] > 0 else 1.0,
            }
        )
    return {"name": entry["name"], "loose": LOOSE, "rows": rows, "commit": commit()}


def told(entries: list[Entry]) -> str:
    """A line of what came out."""
    rows = [row for e in entries for row in e["rows"]]
    before, after = (sum(row["inside"][k] for row in rows) for k in (0, 1))
    wider = [float(np.quantile([row["wider"] for row in rows], q)) for q in (0.5, 0.9)]
    return (
        f"{len(entries)} cases, {len(rows)} parameters: inside {before} with the file's priors, "
        f"{after} with looser ones too; wider by {wider[0]:.2f} in the median, {wider[1]:.2f} in "
        "the widest tenth"
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
