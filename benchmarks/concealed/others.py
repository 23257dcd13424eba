"""RESULTS.md on two effects at once and causes outside the catalogue, by one engine of late.

``python -m benchmarks.concealed.proof --catalogue full --effects 0 --nulls 0 --others 60
--out benchmarks/results/others.jsonl`` runs them: few of the rounds' cases are such.
"""

from __future__ import annotations

from benchmarks.concealed.distances import Entry
from benchmarks.concealed.fold import folded
from benchmarks.concealed.tables import FULL_AIMS, ONCE, commits, cut_off, headline

STEM, WHOLE = "others", 120  # its files, and how many cases are asked
SINGLE = 8  # rows of the headline that count single effects and nulls


def section(entries: list[Entry]) -> list[str]:
    """Lines of RESULTS.md on its outcomes; none where there are none."""
    if not entries:
        return []
    heads, one = headline(entries, FULL_AIMS), len({e["commit"] for e in entries}) == 1
    return [
        "## Pairs and causes outside the catalogue, once more",
        "",
        "`python -m benchmarks.concealed.proof --catalogue full --effects 0 --nulls 0 --others 60 "
        f"--out benchmarks/results/{STEM}.jsonl`: {len(entries)} sealed cases of {WHOLE}, engine "
        f"at commit {commits(entries)}, seeds: sha256 of {commits(entries, 'origin')}; "
        f"{cut_off(entries, STEM)} cut off. " + ("One engine ran all." if one else ONCE.strip()),
        "",
        *heads[:2],
        *heads[2 + SINGLE :],
        "",
        *folded("Case by case", _one_by_one(entries)),
        "",
    ]


def _one_by_one(entries: list[Entry]) -> list[str]:
    rows = [
        f"| {e['name']} | {_planted(e)} | {e['truth']['E']:.0f} | {_or_dash(e['truth']['E_sep'])} "
        f"| {e['outcome']} |"
        for e in entries
    ]
    return ["| case | planted | E | E_sep | outcome |", "|---|---|---|---|---|", *rows]


def _planted(entry: Entry) -> str:
    effects = entry["truth"]["effects"]
    return ", ".join(f"{e['name']} at {e['location']}" for e in effects) or "outside"


def _or_dash(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"
