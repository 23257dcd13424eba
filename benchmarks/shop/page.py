"""The table of docs/shop.md, between its marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.case import ROOT, table
from benchmarks.shop.cases import CASES
from benchmarks.shop.grade import grade, pairs, sets, summary

PAGE = ROOT / "docs" / "shop.md"
COMMAND = "python -m benchmarks.shop"
BEGIN, END = "<!-- table: python -m benchmarks.shop --render -->", "<!-- end of the table -->"
HEAD = ["scenario", "what was done", "truth", "verdict", "named", "place", "grade", "s"]
Entry = Mapping[str, Any]


def rows(entries: Sequence[Entry]) -> list[list[str]]:
    """A line for each case that was run, in the order of the cases."""
    kept = {entry["name"]: entry for entry in entries}
    return [_row(kept[name]) for name in CASES if name in kept]


def _row(entry: Entry) -> list[str]:
    case, told = CASES[entry["name"]], entry["told"]
    named = " or ".join(_words(one) for one in sets(told)) or _words(pairs(told["effects"])) or "-"
    return [case.name, case.done, case.truth.text, told["verdict"], named,
            told["coordinate"] or "-", grade(case.truth, told),
            f"{entry['seconds']:.0f}"]  # fmt: skip


def _words(named: frozenset[tuple[str, str]]) -> str:
    return " + ".join(f"{name} at {place}" for name, place in sorted(named))


def measured(entries: Sequence[Entry]) -> str:
    """Where the table is from, its sum, the table."""
    told = [(CASES[e["name"]].truth, e["told"]) for e in entries if e["name"] in CASES]
    line = summary(told, len(CASES))
    if not told:
        return line
    commits = ", ".join(dict.fromkeys(entry["commit"][:12] for entry in entries))
    return f"`{COMMAND}` at commit {commits}. {line}\n\n{table(HEAD, rows(entries))}"


def rendered(entries: Sequence[Entry], text: str) -> str:
    """A page with its table renewed."""
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{measured(entries)}\n\n{END}{rest.partition(END)[2]}"


def render(entries: Sequence[Entry]) -> None:
    """Write the page."""
    text = rendered(entries, PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8", newline="\n")
