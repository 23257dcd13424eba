"""Level L4 once more: the free-form curve of a struck entry, by one engine of late.

``python -m benchmarks.concealed.curves --origin COMMIT [--shard i/n] [--minutes M]`` draws causes
that are a force along an axis by speed, place or time, strikes their entry, diagnoses, and compares
the law that is told with the force that was planted.  It goes on where it stopped; ``--round anew``
is a second one.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.calibration import place_right, rate
from benchmarks.concealed.cases import effect_cases, seed_of
from benchmarks.concealed.curve import curve_error
from benchmarks.concealed.distances import Entry
from benchmarks.concealed.fold import folded
from benchmarks.concealed.proof import RESULTS, append, commit, in_time, run_sealed, waiting
from benchmarks.concealed.score import NEAR_TWIN
from benchmarks.concealed.tables import ONCE, commits, cut_off, is_twin

REPEATS, NEAR, TARGET = 10, 0.2, 1000.0
KEPT = ("location", "argument", "knots", "values", "acts", "parameters")  # of a law
ROUNDS = {"curves": "once more", "anew": "anew"}  # stems of results, and their headings
AXIAL = (
    "stribeck_friction", "friction_vs_position", "quadratic_drag", "friction_warmup", "cable_drag",
    "constant_force",
)  # fmt: skip


def cases() -> list[tuple[str, dict[str, Any]]]:
    """Every effect in turn, all of E 1000; with the strike of its own entry."""
    return [
        (f"struck-{name}", wanted | {"catalogue": "full", "target_E": TARGET})
        for name, wanted in effect_cases(REPEATS, "full")
        if wanted["effect"] in AXIAL
    ]


def run(name: str, wanted: dict[str, Any], origin: str, out: Path) -> Entry:
    """One sealed case, its entry struck."""
    seals, without = out.with_suffix(".seals.jsonl"), frozenset({wanted["effect"]})
    entry, case, _, found = run_sealed(name, seed_of(origin, name), wanted, without, seals)
    kept = [
        {k: law[k] for k in KEPT if k in law} for law in found.document["effects"] if "knots" in law
    ]
    error = curve_error(case, found.document)
    return entry | {"origin": origin, "laws": kept, "curve_error": error}


def section(entries: list[Entry], stem: str = "curves") -> list[str]:
    """Lines of RESULTS.md on the outcomes of a round; none where there are none."""
    if not entries:
        return []
    told = sorted(e["curve_error"] for e in entries if e["curve_error"] is not None)
    clear = [e for e in entries if e["truth"]["E_sep"] >= NEAR_TWIN]
    none = [e for e in clear if not is_twin(e["document"]["verdict"], e["reached"]["explained"])]
    one = len({e["commit"] for e in entries}) == 1
    return [
        f"## The curve of a struck entry, {ROUNDS[stem]}",
        "",
        f"`python -m benchmarks.concealed.curves{_option(stem)}`: {len(entries)} sealed cases of "
        f"{len(cases())}, engine at commit {commits(entries)}, "
        f"seeds: sha256 of {commits(entries, 'origin')}; {cut_off(entries, stem)} cut off. "
        + ("One engine ran all." if one else ONCE.strip()),
        "",
        "Causes that are a force along an axis by speed, place or time, E 1000 asked, their entry "
        f"deleted. Confidently misnamed: {_named(entries)}, without a nearer twin (E_sep >= 100) "
        f"{_named(clear)}, where what is named is no twin either (100 or more off the noise-free "
        f"truth; two effects may stand for one) {_named(none)}. Without a nearer twin "
        f"`unexplained` with the right coordinate: {_placed(clear)}.",
        "",
        "Rms of the law told minus the planted force over that of the force, where a law on that "
        f"axis is told (aim {NEAR}): {rate(sum(c <= NEAR for c in told), len(told))} within it, "
        f"median {np.median(told) if told else np.nan:.2f}.",
        "",
        *folded("Case by case", _one_by_one(entries)),
        "",
    ]


def _option(stem: str) -> str:
    return "" if stem == "curves" else f" --round {stem}"


def _named(entries: list[Entry]) -> str:
    return rate(sum(e["outcome"] == "wrong" for e in entries), len(entries))


def _placed(entries: list[Entry]) -> str:
    """How many are left open, at the right coordinate."""
    said = [(e["truth"], e["document"]) for e in entries]
    right = [
        document["verdict"] == "unexplained"
        and place_right(truth, document["located"]["coordinate"])
        for truth, document in said
    ]
    return rate(sum(right), len(right))


def _one_by_one(entries: list[Entry]) -> list[str]:
    rows = [
        f"| {e['name']} | {e['truth']['effects'][0]['location']} | {e['truth']['E']:.0f} | "
        f"{e['truth']['E_sep']:.0f} | {e['document']['verdict']} | {_law(e)} | {_error(e)} |"
        for e in entries
    ]
    head = "| case | at | E | E_sep | said | law | off |"
    return [head, "|---|---|---|---|---|---|---|", *rows]


def _law(entry: Entry) -> str:
    return ", ".join(f"{a['location']} by {a['argument']}" for a in entry["laws"]) or "-"


def _error(entry: Entry) -> str:
    return "-" if entry["curve_error"] is None else f"{entry['curve_error']:.2f}"


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--origin", default=commit(), help="what the seeds follow from")
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    parser.add_argument("--round", choices=ROUNDS, default="curves", help="where outcomes go")
    given = parser.parse_args()
    left, out = waiting(
        cases(),
        given.shard,
        RESULTS / f"{given.round}.jsonl",
        lambda e: e["origin"] == given.origin,
    )
    for name, wanted in in_time(left, given.minutes, "struck entries"):
        append(out, run(name, wanted, given.origin, out))


if __name__ == "__main__":
    main()
