"""The table of docs/strange.md, between its marks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from typing import Any

from benchmarks.case import ROOT, table
from benchmarks.concealed.calibration import rate
from benchmarks.shop.case import AMBIGUOUS
from benchmarks.shop.grade import ABSTAINED, ALARM, MISSED, PLACE, RIGHT, WRONG, grade, pairs, sets
from benchmarks.shop.store import Entry
from benchmarks.strange.draw import truth_of

PAGE = ROOT / "docs" / "strange.md"
COMMAND = "python -m benchmarks.strange"
BEGIN, END = f"<!-- table: {COMMAND} --render -->", "<!-- end of the table -->"
HEAD = ["case", "concealed", "E0", "verdict", "named", "place", "grade", "s"]
CLASS = "class"
OF_CAUSES = (RIGHT, CLASS, PLACE, ABSTAINED, MISSED, WRONG)
OF_NULLS = (RIGHT, ABSTAINED, ALARM, WRONG)
KINDS = {"a cause": OF_CAUSES, "two causes": OF_CAUSES, "nothing": OF_NULLS}


def marked(truth: dict[str, Any], told: dict[str, Any]) -> str:
    """The grade; right among the sets that are left open is of its own kind."""
    value = grade(truth_of(truth), told)
    return CLASS if value == RIGHT and told["verdict"] == AMBIGUOUS else value


def words(effects: frozenset[tuple[str, str]]) -> str:
    """Names and places."""
    return " + ".join(f"{name} at {place}" for name, place in sorted(effects))


def named(told: dict[str, Any]) -> list[str]:
    """What is named: one set, or those that are left open."""
    found = [words(one) for one in sets(told)] or [words(pairs(told["effects"]))]
    return [one for one in found if one]


def _row(entry: Entry) -> list[str]:
    truth, told = entry["truth"], entry["told"]
    concealed, names = truth_of(truth).text, " or ".join(named(told))
    strength = f"{truth['E0']:.2g}" if truth["effect"] else "-"
    return [str(entry["number"]), concealed, strength, told["verdict"], names or "-",
            told["coordinate"] or "-", marked(truth, told), f"{entry['seconds']:.0f}"]  # fmt: skip


def _concealed(truth: dict[str, Any]) -> str:
    """Nothing, a cause, or two."""
    if truth["effect"] is None:
        return "nothing"
    return "two causes" if "effects" in truth else "a cause"


def summary(entries: Sequence[Entry]) -> str:
    """Counts of one origin's cases and Wilson bounds."""
    marks: dict[str, Counter[str]] = {}
    for e in entries:
        counts = marks.setdefault(_concealed(e["truth"]), Counter())
        counts[marked(e["truth"], e["told"])] += 1
    lines = [
        [what, name, rate(marks[what][name], marks[what].total())]
        for what, grades in KINDS.items()
        if what in marks
        for name in grades
    ]
    return table(["concealed", "grade", "share [Wilson 95 %]"], lines)


def _section(origin: str, entries: Sequence[Entry]) -> str:
    commits = ", ".join(dict.fromkeys(e["commit"][:12] for e in entries))
    ratio = sum(e["seconds"] for e in entries) / sum(e["recorded"] for e in entries)
    head = (
        f"Origin {origin[:12]}, {len(entries)} cases, engine at commit {commits}; diagnosing took "
    )
    return (
        f"{head}{ratio:.1f} times what was recorded.\n\n{summary(entries)}\n\n"
        f"{table(HEAD, [_row(e) for e in entries])}"
    )


def rendered(entries: Sequence[Entry], text: str) -> str:
    """A page with its table renewed."""
    groups = groupby(entries, key=lambda e: str(e["origin"]))
    told = "\n\n".join(_section(origin, list(these)) for origin, these in groups)
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{told or 'None was run so far.'}\n\n{END}{rest.partition(END)[2]}"


def render(entries: Sequence[Entry]) -> None:
    """Write the page."""
    text = rendered(entries, PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8", newline="\n")
