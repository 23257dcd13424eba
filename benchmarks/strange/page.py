"""The table of docs/strange.md, between its marks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from benchmarks.case import ROOT, table
from benchmarks.concealed.calibration import rate
from benchmarks.shop.case import AMBIGUOUS
from benchmarks.shop.grade import ABSTAINED, ALARM, MISSED, PLACE, RIGHT, WRONG, grade, pairs, sets
from benchmarks.shop.store import Entry
from benchmarks.strange.draw import LOOPED_PAIRS, OTHERS, has_loop, truth_of
from benchmarks.strange.store import evidences

PAGE = ROOT / "docs" / "strange.md"
COMMAND = "python -m benchmarks.strange"
BEGIN, END = f"<!-- table: {COMMAND} --render -->", "<!-- end of the table -->"
HEAD = ["case", "concealed", "E0", "E", "verdict", "named", "place", "grade", "s"]
CLASS = "class"
Evidences = Mapping[str, Sequence[float]]  # E of each cause, by the name of its case
OF_CAUSES = (RIGHT, CLASS, PLACE, ABSTAINED, MISSED, WRONG)
OF_NULLS = (RIGHT, ABSTAINED, ALARM, WRONG)
BANDS = {
    "1000 and more": (1e3, float("inf")),
    "300 to 1000": (300.0, 1e3),
    "below 300": (0.0, 300.0),
}
KINDS = {"a cause": OF_CAUSES, "two causes": OF_CAUSES, "nothing": OF_NULLS}
KINDS |= {f"{what}{of}": grades for of in (", dc", ", rest") for what, grades in KINDS.items()}


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


def _row(entry: Entry, known: Evidences) -> list[str]:
    truth, told = entry["truth"], entry["told"]
    concealed, names = truth_of(truth).text, " or ".join(named(told))
    strength = f"{truth['E0']:.2g}" if truth["effect"] else "-"
    left = " + ".join(f"{e:.2g}" for e in known.get(entry["name"], ()))
    return [str(entry["number"]), concealed, strength, left or "-", told["verdict"], names or "-",
            told["coordinate"] or "-", marked(truth, told), f"{entry['seconds']:.0f}"]  # fmt: skip


def _concealed(entry: Entry) -> str:
    """Nothing, a cause, or two; and whether of a machine with dc motors, or of the rest."""
    truth, number = entry["truth"], entry["number"]
    rest = OTHERS <= number < LOOPED_PAIRS
    of = ", dc" if has_loop(number) else ", rest" if rest else ""
    if truth["effect"] is None:
        return f"nothing{of}"
    return f"{'two causes' if 'effects' in truth else 'a cause'}{of}"


def summary(entries: Sequence[Entry]) -> str:
    """Counts of one origin's cases and Wilson bounds."""
    marks: dict[str, Counter[str]] = {}
    for e in entries:
        counts = marks.setdefault(_concealed(e), Counter())
        counts[marked(e["truth"], e["told"])] += 1
    lines = [
        [what, name, rate(marks[what][name], marks[what].total())]
        for what, grades in KINDS.items()
        if what in marks
        for name in grades
    ]
    return table(["concealed", "grade", "share [Wilson 95 %]"], lines)


def by_evidence(entries: Sequence[Entry], known: Evidences) -> str:
    """Counts by the least E of a case's causes, where that is known of all: those that went wrong
    are asked first, and would be most of the rest.
    """
    lines = []
    for what in (what for what, grades in KINDS.items() if grades is OF_CAUSES):
        those = [e for e in entries if _concealed(e) == what]
        those = those if all(e["name"] in known for e in those) else []
        for band, (low, high) in BANDS.items():
            here = [e for e in those if low <= min(known[e["name"]]) < high]
            counts = Counter(marked(e["truth"], e["told"]) for e in here)
            shares = [rate(counts[name], len(here)) for name in (RIGHT, CLASS, WRONG)]
            lines += [[what, band, *shares]] if here else []
    return table(["concealed", "E, least", RIGHT, CLASS, WRONG], lines) if lines else ""


def _section(origin: str, entries: Sequence[Entry], known: Evidences) -> str:
    commits = ", ".join(dict.fromkeys(e["commit"][:12] for e in entries))
    ratio = sum(e["seconds"] for e in entries) / sum(e["recorded"] for e in entries)
    head = (
        f"Origin {origin[:12]}, {len(entries)} cases, engine at commit {commits}; diagnosing took "
    )
    shares = [t for t in (summary(entries), by_evidence(entries, known)) if t]
    rows = table(HEAD, [_row(e, known) for e in entries])
    return "\n\n".join([f"{head}{ratio:.1f} times what was recorded.", *shares, rows])


def rendered(entries: Sequence[Entry], text: str, known: Evidences) -> str:
    """A page with its table renewed."""
    groups = groupby(entries, key=lambda e: str(e["origin"]))
    told = "\n\n".join(_section(origin, list(these), known) for origin, these in groups)
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{told or 'None was run so far.'}\n\n{END}{rest.partition(END)[2]}"


def render(entries: Sequence[Entry]) -> None:
    """Write the page."""
    text = rendered(entries, PAGE.read_text(encoding="utf-8"), evidences())
    PAGE.write_text(text, encoding="utf-8", newline="\n")
