"""RESULTS.md out of the outcomes of the proof: every figure with its n and Wilson interval."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.calibration import rate, section
from benchmarks.concealed.proof import RESULTS, read
from benchmarks.concealed.score import NEAR_TWIN
from benchmarks.concealed.seeds import section as seeds
from benchmarks.concealed.settle import section as settled
from benchmarks.mechanism.page import section as mechanisms

Entry = dict[str, Any]
LARGE = 50  # cases of an earlier run that is shown in full
STRONG = 700.0  # planted at E = 1000; the real E scatters around it
TEN_AIMS = ("95 %", "95 %", "-", "-", "<= 2 %", "<= 1 %", "-", "-", "-")
FULL_AIMS = ("98 %", "95 %", "92 %", "-", "<= 1 %", "<= 1 %", "90 %", "<= 3 %", "90 %")
OUTCOMES = ("right", "class", "abstained", "missed", "wrong", "false_alarm")


def _of(entries: list[Entry], kind: str) -> list[Entry]:
    return [e for e in entries if e["truth"]["kind"] == kind]


def _clear(entry: Entry) -> bool:
    twin = entry["truth"]["E_sep"]
    return twin is not None and twin >= NEAR_TWIN


def _hits(entries: list[Entry], *outcomes: str) -> int:
    return sum(e["outcome"] in outcomes for e in entries)


def headline(entries: list[Entry], aims: tuple[str, ...] = TEN_AIMS) -> list[str]:
    """The rows against the aims."""
    single = _of(entries, "effect")
    strong = [e for e in single if e["truth"]["E"] >= STRONG]
    clear, near = [e for e in strong if _clear(e)], [e for e in strong if not _clear(e)]
    weak = [e for e in single if 100 <= e["truth"]["E"] < STRONG]
    kinds = ("pair", "outside")
    pairs, outside = ([e for e in _of(entries, k) if e["truth"]["E"] >= STRONG] for k in kinds)
    asked = (
        ("one effect, E >= 1000, E_sep >= 100: right name and place", clear, ("right",)),
        (
            "one effect, E >= 1000, nearer twins: right, or a class with the truth in it",
            near,
            ("right", "class"),
        ),
        ("one effect, E about 300: right name and place", weak, ("right",)),
        ("the same, class with the truth in it counted", weak, ("right", "class")),
        ("wrong and confident, all single effects", single, ("wrong",)),
        (
            "nulls with imperfect nuisances: anything named or doubted",
            _of(entries, "null"),
            ("false_alarm",),
        ),
        ("two effects, E >= 1000 each: both named, nothing extra", pairs, ("right",)),
        ("outside the catalogue, E >= 1000: confidently misnamed", outside, ("wrong",)),
        ("outside the catalogue, E >= 1000: `unexplained`", outside, ("right",)),
    )
    table = ["| measure | aim | measured [Wilson 95 %] |", "|---|---|---|"]
    return table + [
        f"| {what} | {aim} | {rate(_hits(group, *outcomes), len(group))} |"
        for (what, group, outcomes), aim in zip(asked, aims, strict=True)
    ]


def _curves(entries: list[Entry]) -> list[float]:
    """Distances of free-form law and planted force, where both are there."""
    found = [e["struck"]["curve_error"] for e in entries]
    return sorted(c for c in found if c is not None)


def levels(entries: list[Entry]) -> list[str]:
    """The five levels of concealment."""
    single = [e for e in _of(entries, "effect") if e["truth"]["E"] >= 100]
    struck = [e for e in single if "struck" in e]
    said = Counter(e["struck"]["verdict"] for e in struck)
    curves = _curves(struck)
    off = ", ".join(f"{c:.2f}" for c in curves) or "none to compare"
    near = sum(c <= 0.2 for c in curves)
    rows = (
        ("L1", "the label is sealed by hash before the engine runs", f"{len(entries)} seals"),
        (
            "L2",
            "the machine file hides the effect as well as values within 0.7 .. 1.45 of the true "
            "ones can, the belts' stiffness without such limits (to a 27th in this run, a mistake "
            "of the plant's, mended since): right name and place, E >= 100",
            rate(_hits(single, "right"), len(single)),
        ),
        (
            "L3",
            "seeds follow from the commit's hash; seals are written before outcomes",
            f"none dropped; {cut_off(entries)} cut off by the clock, without an outcome",
        ),
        (
            "L4",
            "the true entry is struck from the catalogue, E >= 100: confidently misnamed",
            rate(said["explained"], len(struck)),
        ),
        ("", "the same: `unexplained`", rate(said["unexplained"], len(struck))),
        (
            "",
            "the same: rms of free-form law minus planted force over that of the force (aim 0.2), "
            "by a measure that is mended since (docs/dev/PLAN.md)",
            f"{near} of {len(curves)} within 0.2: {off}",
        ),
        (
            "L5",
            "real recordings",
            "[EMPS](docs/cases/emps.md): pulses that others logged, found without the log;"
            " [one printer](docs/cases/voron.md)",
        ),
    )
    table = ["| level | what is concealed | measured [Wilson 95 %] |", "|---|---|---|"]
    return table + [f"| {a} | {b} | {c} |" for a, b, c in rows]


def cut_off(entries: list[Entry]) -> int:
    """Sealed cases of these origins that never came to an outcome: the clock ended their run."""
    done = {(e["name"], e["seed"]) for e in entries}
    seals = [s for path in RESULTS.glob("proof*.seals.jsonl") for s in read(path)]
    return len({(s["name"], s["seed"]) for s in seals} - done)


def by(entries: list[Entry], key: str) -> list[str]:
    """Outcomes of the single-effect cases by effect, setting or noise."""
    groups: dict[str, Counter[str]] = {}
    for e in _of(entries, "effect"):
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


def earlier() -> list[str]:
    """The runs before this one, of engines that were changed since: large ones in full."""
    groups: dict[str, list[Entry]] = {}
    for e in read(RESULTS / "earlier.jsonl"):
        full = e["wanted"].get("catalogue") == "full"
        groups.setdefault(e["commit"][:12] + ", all 35 effects" * full, []).append(e)
    if not groups:
        return []
    lines = ["## Earlier runs", "", "Runs of engines that were changed since, on other seeds:", ""]
    for commit, entries in groups.items():
        if len(entries) < LARGE:
            said = Counter(f"{e['truth']['kind']} {e['outcome']}" for e in entries)
            lines += [f"- {commit}: {', '.join(f'{n} {k}' for k, n in sorted(said.items()))}"]
        else:
            lines += ["", f"{len(entries)} cases at {commit}:", "", *headline(entries), ""]
    return [*lines, ""]


def full() -> list[str]:
    """The proof over all 35 effects, as far as it was run."""
    entries = [e for p in sorted(RESULTS.glob("full*.jsonl")) if "seals" not in p.name
               for e in read(p)]  # fmt: skip
    if not entries:
        return []
    commits = ", ".join(sorted({e["commit"][:12] for e in entries}))
    return [
        "## All 35 effects",
        "",
        f"`python -m benchmarks.concealed.proof --catalogue full`, {len(entries)} sealed cases so "
        f"far, engine at commit {commits}; all 35 effects are planted, and all compete. Before it, "
        "draws on other seeds were development: forms of the plant's that were left open then (the "
        "viscous friction of `friction_warmup`, the overtone of `tooth_ripple`, the threshold of "
        "`driver_deadband`, the knee of `supply_saturation`) are inside the catalogue since; after "
        "misses of earlier runs, so are a soft onset of `belt_slack` and `load_friction` by both "
        "forces. 26 cases of 46916cf are in no table: they were lost with the machine that ran "
        "them (13 of 18 effects right, 3 a class, 1 left open, wrong 0, nulls 5 of 5, pair and "
        "outside right, as far as seen), as were the last ten or so of e910964 "
        "(presliding_hysteresis-0 wrong: y for xy). The guard's limit `SURE` was set on what all "
        "runs before this one left over, those of e910964 among them.",
        "",
        *headline(entries, FULL_AIMS),
        "",
        *by(entries, "effect"),
        "",
    ]


def page(entries: list[Entry], command: str) -> str:
    """The whole of RESULTS.md."""
    commits = sorted({e["commit"][:12] for e in entries})
    origins = sorted({e["origin"][:12] for e in entries})
    lines = [
        "# Results: the concealed-effect proof",
        "",
        f"Rendered by `{command}` from `benchmarks/results/proof*.jsonl`:",
        f"{len(entries)} sealed cases, engine at commit {', '.join(commits)}, seeds: sha256 of",
        f"{', '.join(origins)}. Machines are drawn around a surrogate of the",
        "paper's lost Table I and two other sets, by a plant that shares no code with the package.",
        "These cases plant ten effects, and the catalogue was cut down to these ten.",
        "In hard cases the plant overstates E (docs/dev/PLAN.md).",
        "Its forms of backlash and of belt stiffness were inside the catalogue, since earlier runs",
        "left them open (`hold`, `parallel`), as were two of its three of Stribeck friction.",
        "Its constant force began with the recording, out of balance, which alone shows it where",
        "offsets are free: a mistake of the plant's, mended since (a known zero shows it now).",
        "What changed in the engine since stands in the changelog; this run says nothing of it.",
        "",
        *headline(entries),
        "",
        "E is the smallest squared distance, in noise units, that retuning the nominal machine",
        "leaves; E_sep is what is left of it beside the nearest rival. `right`: exactly the",
        "planted set named; `class`: `ambiguous` with the truth among its members; `abstained`:",
        "other doubts; `missed`: nothing found; `wrong`: confident and false.",
        "",
        "## Levels of concealment",
        "",
        *levels(entries),
        "",
        *section(entries),
        *earlier(),
        "## By effect",
        "",
        *by(entries, "effect"),
        "",
        "## By setting",
        "",
        *by(entries, "setting"),
        "",
        *full(),
        *seeds(),
        *settled(),
        *mechanisms(),
        "## Speed",
        "",
        f"One diagnosis on one core over the length of its training recordings: {speed(entries)}.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Write RESULTS.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("RESULTS.md"))
    parser.add_argument("--sources", type=Path, nargs="*")
    arguments = parser.parse_args()
    sources = arguments.sources or sorted(
        p for p in RESULTS.glob("proof*.jsonl") if "seals" not in p.name
    )
    entries = [e for path in sources for e in read(path)]
    arguments.out.write_text(
        page(entries, "python -m benchmarks.concealed.render"), encoding="utf-8"
    )
    print(json.dumps(Counter(e["outcome"] for e in entries)))


if __name__ == "__main__":
    main()
