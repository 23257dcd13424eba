"""Whether the experiment that an ambiguous verdict proposes settles it at the first try.

``python -m benchmarks.concealed.settle [--shard i/n] [--minutes M]`` takes all cases that any run
of the proof left ambiguous, those of all 35 effects first and of them those that the plant calls
farthest from their nearest rival, draws each once more, diagnoses it against all effects, runs the
proposed program on the concealed plant as often as it says, and diagnoses all recordings together.
It goes on where it stopped.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import plant

from benchmarks.concealed.blind import load
from benchmarks.concealed.calibration import rate
from benchmarks.concealed.fold import folded
from benchmarks.concealed.proof import (
    RESULTS,
    append,
    commit,
    in_time,
    kept_of,
    outcomes,
    read,
    waiting,
)
from benchmarks.concealed.score import score
from corexy_fmi.engine import Diagnosis, diagnose
from corexy_fmi.engine.planning.experiment import Experiment
from corexy_fmi.engine.telling.classes import equals
from corexy_fmi.recording import Recording, read_recording

STORE, STEMS = RESULTS / "settle.jsonl", ("full", "earlier", "proof")
BEFORE = RESULTS / "before_settle.jsonl"  # of an engine that was changed since


def ambiguous() -> list[tuple[str, dict[str, Any]]]:
    """Name (with its seed, for runs share names), seed and wish of the ambiguous cases; those that
    were run before the engine was changed, and that the change was made on, come last.
    """
    seen = {e["name"] for e in read(BEFORE)}
    entries = [e for stem in STEMS for e in outcomes(stem)]
    found = [e for e in entries if e["document"]["verdict"] == "ambiguous"]
    named = [
        (f"{e['name']}:{e['seed']}", {"seed": e["seed"], "wanted": e["wanted"]})
        for e in sorted(found, key=_turn)
    ]
    return sorted(named, key=lambda case: case[0] in seen)


def _turn(entry: dict[str, Any]) -> tuple[bool, float]:
    """All 35 effects first, then what is apart."""
    return entry["wanted"].get("catalogue") != "full", -(entry["truth"]["E_sep"] or 0.0)


def performed(case: Any, proposed: Experiment) -> list[Recording]:
    """The proposed program, run on the concealed plant as often as it asks."""
    order = proposed.order
    angles = np.column_stack([order["phi1"], order["phi2"]])
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for n in range(proposed.times or 0):
            path = Path(folder) / f"experiment{n}.csv"
            path.write_text(plant.perform(case, angles, n), encoding="utf-8")
            found.append(read_recording(path))
    return found


def settled(name: str, wish: dict[str, Any]) -> dict[str, Any]:
    """What is said of one case before and after the experiment."""
    case = plant.draw(wish["seed"], **wish["wanted"])
    train, holdout, machine = load(case)
    first = diagnose(train, holdout, machine, jobs=1)
    entry = {"name": name, **wish, "truth": case.truth, "before": _said(first, case)}
    proposed = first.experiment
    if proposed is not None:
        entry |= {"why": proposed.why, "times": proposed.times}
    if proposed is not None and proposed.times is not None:
        (holdout if proposed.kept_back else train).extend(performed(case, proposed))
        after = diagnose(train, holdout, machine, jobs=1)
        entry["after"] = _said(after, case)
    return entry | {"commit": commit()}


def _said(found: Diagnosis, case: Any) -> dict[str, Any]:
    return kept_of(found) | {"outcome": score(found.document, case.truth)}


def section() -> list[str]:
    """Lines of RESULTS.md."""
    files = sorted(p for p in RESULTS.glob("settle*.jsonl"))
    entries, before = [e for path in files for e in read(path)], read(BEFORE)
    if not entries:
        return []
    return [
        "## The next experiment",
        "",
        "`python -m benchmarks.concealed.settle`: ambiguous cases of the proof, each diagnosed "
        "again after the proposed program was run on the concealed plant as often as it says; "
        f"{_summary(entries)}. {len(ambiguous())} cases wait in all; those that no engine before "
        "had run come first, those of largest E_sep before others, which is no random choice; "
        f"passed over so far: {_passed_over(entries)}.",
        *([f"Before that, some of them by two engines, {_summary(before)}."] if before else []),
        "",
        *folded(
            f"{len(entries)} cases one by one",
            [
                "| case | planted | before | runs | after |",
                "|---|---|---|---|---|",
                *(_row(e) for e in entries),
            ],
        ),
        "",
    ]


def _passed_over(entries: list[dict[str, Any]]) -> str:
    """Cases that would have had their turn before one that was run."""
    run, turns = {e["name"] for e in entries}, [name for name, _ in ambiguous()]
    last = max((k for k, name in enumerate(turns) if name in run), default=0)
    return ", ".join(name for name in turns[:last] if name not in run) or "none"


def _summary(entries: list[dict[str, Any]]) -> str:
    asked = [e for e in entries if "after" in e and e["before"]["outcome"] == "class"]
    said = Counter(e["after"]["outcome"] for e in asked)
    none = sum("after" not in e for e in entries)
    clear = sum(e["before"]["verdict"] != "ambiguous" for e in entries)
    others = ", ".join(f"{n} {k}" for k, n in sorted(said.items()) if k not in ("right", "wrong"))
    commits = ", ".join(sorted({e["commit"][:12] for e in entries}))
    return (
        f"engine {commits}: of {len(entries)} cases, {none - clear} got no program (no motion, run "
        f"as often as the data bear, parts the rivals), {clear} were not ambiguous any more; where "
        "the truth was in the class, settled right at the first try (aim 90 %) "
        f"{rate(said['right'], len(asked))}, settled wrong {said['wrong']}"
        + (f", else {others}" if others else "")
    )


def _row(entry: dict[str, Any]) -> str:
    planted = " + ".join(f"{e['name']} at {e['location']}" for e in entry["truth"]["effects"])
    after = entry.get("after")
    told = _words(after) if after else "no program"
    times = entry.get("times") or "-"
    return f"| {entry['name']} | {planted} | {_words(entry['before'])} | {times} | {told} |"


def _words(said: dict[str, Any]) -> str:
    group = {f"{m['name']} at {m['location']}"
             for found in equals(said) for members in found for m in members}  # fmt: skip
    names = sorted(group) or [f"{e['name']} at {e['location']}" for e in said["effects"]]
    return f"{said['verdict']}: {', '.join(names)}" if names else said["verdict"]


def main() -> None:
    """Run the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shard", default="0/1", help="i/n: every n-th case, from i")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    parser.add_argument("--out", type=Path, default=STORE)
    given = parser.parse_args()
    cases, out = waiting(ambiguous(), given.shard, given.out, lambda entry: True)
    for name, wish in in_time(cases, given.minutes, "ambiguous cases"):
        append(out, settled(name, wish))


if __name__ == "__main__":
    main()
