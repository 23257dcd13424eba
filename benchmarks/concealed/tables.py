"""Tables of RESULTS.md: outcomes against the aims, levels of concealment, counts by group."""

from __future__ import annotations

from collections import Counter

import numpy as np

from benchmarks.concealed.calibration import place_right, rate
from benchmarks.concealed.distances import STRONG, Entry, misread, of
from benchmarks.concealed.proof import seals
from benchmarks.concealed.score import NEAR_TWIN

TEN_AIMS = ("95 %", "95 %", *4 * ("-",), "<= 2 %", "<= 1 %", *5 * ("-",))
FULL_AIMS = (
    *("98 %", "95 %", "-", "-", "92 %", "-", "<= 1 %", "<= 1 %"),  # one effect, none
    *("90 %", "-", "-", "<= 3 %", "90 %"),  # two, outside
)
ONCE = (
    "Every case was diagnosed once, by the engine of its day: what a case showed was mended for "
    "those after it, and none that was scored was run again. "
)
HALF = ("right", "half a class")
OUTCOMES = ("right", "class", "abstained", "missed", "wrong", "false_alarm")


def _clear(entry: Entry) -> bool:
    twin = entry["truth"]["E_sep"]
    return twin is not None and twin >= NEAR_TWIN


def _hits(entries: list[Entry], *outcomes: str) -> int:
    """How many came out so; of `HALF` every second class, rounded down."""
    halves = _hits(entries, "class") // 2 if outcomes == HALF else 0
    return sum(e["outcome"] in outcomes for e in entries) + halves


def headline(
    entries: list[Entry], aims: tuple[str, ...] = TEN_AIMS, latest: list[Entry] | None = None
) -> list[str]:
    """The rows against the aims; beside them those of the ``latest`` cases, where told apart."""
    heads = ["measure", "aim", "measured [Wilson 95 %]"]
    rows = _rows(entries, aims)
    if latest is not None:
        heads[2:] = [f"all {len(entries)} [Wilson 95 %]", f"the latest {len(latest)}"]
        rows = [(*row, own[-1]) for row, own in zip(rows, _rows(latest, aims), strict=True)]
    lines = [heads, ["---"] * len(heads), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def _rows(entries: list[Entry], aims: tuple[str, ...]) -> list[tuple[str, ...]]:
    """What is asked, its aim, and its rate."""
    single = of(entries, "effect")
    strong = [e for e in single if e["truth"]["E"] >= STRONG]
    clear, near = [e for e in strong if _clear(e)], [e for e in strong if not _clear(e)]
    weak = [e for e in single if 100 <= e["truth"]["E"] < STRONG]
    kinds = ("pair", "outside")
    pairs, outside = ([e for e in of(entries, k) if e["truth"]["E"] >= STRONG] for k in kinds)
    asked = (
        ("one effect, E >= 1000, E_sep >= 100: right name and place", clear, ("right",)),
        (
            "one effect, E >= 1000, nearer twins: right, or a class with the truth in it",
            near,
            ("right", "class"),
        ),
        ("one effect, E about 300: right name and place", weak, ("right",)),
        ("the same, no nearer twin (E_sep >= 100)", [e for e in weak if _clear(e)], ("right",)),
        ("the same, twins too: a class with the truth in it counts half", weak, HALF),
        ("the same: such a class counts whole", weak, ("right", "class")),
        ("wrong and confident, all single effects", single, ("wrong",)),
        (
            "nulls with imperfect nuisances: anything named or doubted",
            of(entries, "null"),
            ("false_alarm",),
        ),
        ("two effects, E >= 1000 each: both named, nothing extra", pairs, ("right",)),
        ("the same, neither with a nearer twin", [e for e in pairs if _clear(e)], ("right",)),
        ("the same, twins too: or a class with both in it", pairs, ("right", "class")),
        ("outside the catalogue, E >= 1000: confidently misnamed", outside, ("wrong",)),
        ("outside the catalogue, E >= 1000: `unexplained`", outside, ("right",)),
    )
    return [
        (what, aim, rate(_hits(group, *outcomes), len(group)))
        for (what, group, outcomes), aim in zip(asked, aims, strict=True)
    ]


def struck(entries: list[Entry]) -> list[tuple[str, str, str]]:
    """Rows of level L4: what is said where the true entry is deleted."""
    cases = [e for e in of(entries, "effect") if "struck" in e and e["truth"]["E"] >= 100]
    clear = [e for e in cases if _clear(e)]
    asked = [e for e in clear if "reached" in e["struck"] and not misread(e)]
    curves = [e["struck"]["curve_error"] for e in cases]
    curves = sorted(c for c in curves if c is not None)
    off = ", ".join(f"{c:.2f}" for c in curves) or "none to compare"
    near = sum(c <= 0.2 for c in curves)
    return [
        (
            "L4",
            "the true entry is struck from the catalogue, E >= 100: confidently misnamed",
            _said(cases, "explained"),
        ),
        ("", "the same, no nearer twin left (E_sep >= 100)", _said(clear, "explained")),
        (
            "",
            "the same, none found by the engine's own fit either (what is named stays 100 or more "
            "off the noise-free truth; kept since)",
            _said([e for e in asked if not _found_twin(e["struck"])], "explained"),
        ),
        ("", "no nearer twin left: `unexplained`", _said(clear, "unexplained")),
        (
            "",
            "no nearer twin left: `unexplained` with the right coordinate",
            _said(clear, "unexplained", True),
        ),
        (
            "",
            "rms of free-form law minus planted force over that of the force (aim 0.2)",
            f"{near} of {len(curves)} within 0.2: {off}",
        ),
    ]


def _found_twin(struck: Entry) -> bool:
    return is_twin(struck["verdict"], struck["reached"])


def is_twin(verdict: str, reached: float) -> bool:
    """Whether what is named for a struck entry comes so near to the truth that it is its twin."""
    return verdict == "explained" and reached < NEAR_TWIN


def _beside(
    rows: list[tuple[str, str, str]], latest: list[Entry] | None
) -> list[tuple[str, str, str]]:
    """Rows with what the latest cases say behind what all say."""
    if latest is None:
        return rows
    late = [value for _, _, value in struck(latest)]
    return [
        (a, b, f"{c}; the latest {len(latest)}: {own}")
        for (a, b, c), own in zip(rows, late, strict=True)
    ]


def _said(cases: list[Entry], verdict: str, placed: bool = False) -> str:
    found = [
        e["struck"]["verdict"] == verdict
        and (not placed or place_right(e["truth"], e["struck"]["coordinate"]))
        for e in cases
    ]
    return rate(sum(found), len(cases))


def levels(
    entries: list[Entry], stem: str, hidden: str = "", latest: list[Entry] | None = None
) -> list[str]:
    """The five levels of concealment; ``hidden``: what is to be said of the machine file; L4 of
    the ``latest`` cases beside that of all, where told apart.
    """
    single = [e for e in of(entries, "effect") if e["truth"]["E"] >= 100]
    rows = [
        ("L1", "the label is sealed by hash before the engine runs", f"{len(entries)} seals"),
        (
            "L2",
            "the machine file hides the effect as well as values within 0.7 .. 1.45 of the true "
            f"ones can{hidden}: right name and place, E >= 100",
            rate(_hits(single, "right"), len(single)),
        ),
        (
            "L3",
            "seeds follow from a commit's hash; seals are written before outcomes",
            f"none dropped; {cut_off(entries, stem)} cut off, without an outcome",
        ),
        *_beside(struck(entries), latest),
        (
            "L5",
            "real recordings",
            "[EMPS](docs/cases/emps.md): pulses that others logged, found without the log;"
            " [one printer](docs/cases/voron.md)",
        ),
    ]
    table = ["| level | what is concealed | measured [Wilson 95 %] |", "|---|---|---|"]
    return table + [f"| {a} | {b} | {c} |" for a, b, c in rows]


def commits(entries: list[Entry], key: str = "commit") -> str:
    """The commits of some outcomes, or those that their seeds follow from."""
    return ", ".join(sorted({e[key][:12] for e in entries}))


def cut_off(entries: list[Entry], stem: str) -> int:
    """Sealed cases of this run that never came to an outcome: something ended it before."""
    done = {(e["name"], e["seed"]) for e in entries}
    return len({(s["name"], s["seed"]) for s in seals(stem)} - done)


def by(entries: list[Entry], key: str) -> list[str]:
    """Outcomes of the single-effect cases by effect, setting or noise."""
    groups: dict[str, Counter[str]] = {}
    for e in of(entries, "effect"):
        label = e["truth"]["effects"][0]["name"] if key == "effect" else str(e["truth"][key])
        groups.setdefault(label, Counter())[e["outcome"]] += 1
    table = [f"| {key} | n | {' | '.join(OUTCOMES[:5])} |", "|---|" + "---|" * 6]
    return table + [
        f"| {g} | {sum(c.values())} | " + " | ".join(str(c[o]) for o in OUTCOMES[:5]) + " |"
        for g, c in sorted(groups.items())
    ]


def speed(entries: list[Entry]) -> str:
    """Seconds of a diagnosis over seconds recorded."""
    ratios = [e["seconds"]["diagnose"] / e["seconds"]["recorded"] for e in entries]
    return f"median {np.median(ratios):.2f}, 90 % below {np.quantile(ratios, 0.9):.2f}"
