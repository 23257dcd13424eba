"""RESULTS.md out of the outcomes of the proof: every figure with its n and Wilson interval."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path
from textwrap import fill

from benchmarks.concealed import curves, faint, others, seeds
from benchmarks.concealed.calibration import section
from benchmarks.concealed.cases import published
from benchmarks.concealed.distances import Entry, overstated, removal
from benchmarks.concealed.fold import folded
from benchmarks.concealed.proof import RESULTS, outcomes, read
from benchmarks.concealed.settle import section as settled
from benchmarks.concealed.tables import (
    FULL_AIMS,
    ONCE,
    TEN_AIMS,
    by,
    commits,
    headline,
    levels,
    speed,
)
from benchmarks.concealed.thresholds import section as thresholds
from benchmarks.concealed.wall import section as wall
from benchmarks.mechanism.page import section as mechanisms

MARKS = ("<!-- seeds -->", "<!-- /seeds -->")  # of README.md
AGAIN = "again"  # the files of the second round
WHOLE = (30, 300, 60)  # cases of a round: of each effect, nulls, pairs and causes outside
LATEST = 100  # cases of a shard that tell of the engines of late
LARGE = 50  # cases of an earlier run that is shown in full
HIDDEN = (
    ", the belts' stiffness without such limits (to a 27th in this run, a mistake of the plant's, "
    "mended since)"
)


def earlier() -> list[str]:
    """The runs before this one, of engines that were changed since: large ones in full."""
    groups: dict[str, list[Entry]] = {}
    for e in read(RESULTS / "earlier.jsonl"):
        full = e["wanted"].get("catalogue") == "full"
        run = e.get("origin", e["commit"])[:12]  # one engine, whatever else was committed in it
        groups.setdefault(run + ", all 35 effects" * full, []).append(e)
    if not groups:
        return []
    lines = ["## Earlier runs", "", "Runs of engines that were changed since, on other seeds:", ""]
    for commit, entries in groups.items():
        if len(entries) < LARGE:
            said = Counter(f"{e['truth']['kind']} {e['outcome']}" for e in entries)
            lines += [f"- {commit}: {', '.join(f'{n} {k}' for k, n in sorted(said.items()))}"]
        else:
            lines += ["", *folded(f"{len(entries)} cases at {commit}", headline(entries)), ""]
    return [*lines, ""]


def tables(
    entries: list[Entry],
    stem: str,
    aims: tuple[str, ...],
    hidden: str = "",
    latest: list[Entry] | None = None,
) -> list[str]:
    """All that is counted of a run."""
    return [
        *headline(entries, aims, latest),
        "",
        *(faint.section(entries) if stem in faint.RUNS else []),
        *removal(entries),
        *overstated(entries),
        "### Levels of concealment",
        "",
        *levels(entries, stem, hidden, latest),
        "",
        *section(entries, latest),
        "### By effect",
        "",
        *by(entries, "effect"),
        "",
        "### By setting",
        "",
        *by(entries, "setting"),
        "",
    ]


def counted(entries: list[Entry]) -> str:
    """How many cases were run, of how many."""
    n, whole = len(entries), len(published(*WHOLE, catalogue="full"))
    return f"all {n} sealed cases" if n == whole else f"{n} sealed cases so far, of {whole}"


def shards() -> list[list[Entry]]:
    """The cases of each shard of the run with all effects, in their order."""
    return [read(RESULTS / f"full.{k}.jsonl") for k in range(2)]


def full(entries: list[Entry]) -> list[str]:
    """The proof over all 35 effects, as far as it was run."""
    once = ONCE if len({e["commit"] for e in entries}) > 1 else ""
    lengths = [str(len(shard)) for shard in shards()]
    latest = [e for shard in shards() for e in shard[-LATEST:]]
    return [
        "## All 35 effects",
        "",
        f"`python -m benchmarks.concealed.proof --catalogue full`: {counted(entries)}, engine at "
        f"commit {commits(entries)}, seeds: sha256 of {commits(entries, 'origin')}. "
        f"{once}All 35 effects are planted, and all compete. From this run on the plant's machine "
        "file keeps the factor that is common to all masses, stiffnesses and frictions near 1, "
        "which no motion tells (before, up to 1.45), and the engine gives smooth friction a scale "
        "of its own at the pulleys, as the plant has it; both were made on seeds of `make blind`.",
        "",
        f"The last column is of the last {LATEST} cases of each shard, engine at commit "
        f"{commits(latest)}.",
        "",
        *tables(entries, "full", FULL_AIMS, latest=latest),
        f"The two shards did not go on alike ({' and '.join(lengths)} cases): one stood at "
        "belt_relaxation-1 for a while, which the plant could not draw (a fit of its own began at "
        "a model that broke down; mended since), and they were not always run together since.",
        "",
        "What is not in it: forms of the plant's that draws on other seeds left open (the viscous "
        "friction of `friction_warmup`, the overtone of `tooth_ripple`, the threshold of "
        "`driver_deadband`, the knee of `supply_saturation`, a soft onset of `belt_slack`, "
        "`load_friction` by both forces, a cable that stiffens, a ripple that follows the command, "
        "bristles that slip one by one) are inside the catalogue since. "
        "26 cases of 46916cf are "
        "in no table: they were lost with the machine that ran them (13 of 18 effects right, 3 a "
        "class, 1 left open, wrong 0, nulls 5 of 5, pair and outside right, as far as seen), as "
        "were the last ten or so of e910964 (presliding_hysteresis-0 wrong: y for xy).",
        "",
    ]


def again(entries: list[Entry]) -> list[str]:
    """The proof once more, on seeds of another commit; whether one engine ran all is told."""
    one = len({e["commit"] for e in entries}) == 1
    return [
        "## All 35 effects, a second round",
        "",
        f"`python -m benchmarks.concealed.proof --catalogue full --out "
        f"benchmarks/results/{AGAIN}.jsonl`: {counted(entries)}, engine at commit "
        f"{commits(entries)}, seeds: sha256 of {commits(entries, 'origin')}. "
        + ("One engine ran all." if one else ONCE.strip()),
        "",
        *tables(entries, AGAIN, FULL_AIMS),
    ]


def ten(entries: list[Entry]) -> list[str]:
    """The run with ten effects, of an engine before."""
    return [
        "## Ten effects, an earlier engine",
        "",
        f"`python -m benchmarks.concealed.proof`: {len(entries)} sealed cases, engine at commit "
        f"{commits(entries)}, seeds: sha256 of {commits(entries, 'origin')}. These cases plant ten "
        "effects, and the catalogue was cut down to these ten. The plant's forms of backlash and "
        "of belt stiffness were inside the catalogue, since earlier runs left them open (`hold`, "
        "`parallel`), as were two of its three of Stribeck friction. Its constant force began with "
        "the recording, out of balance, which alone shows it where offsets are free: a mistake of "
        "the plant's, mended since (a known zero shows it now). Free-form laws were compared by a "
        "measure that is mended since. What changed in the engine since stands "
        "in the changelog; this run says nothing of it.",
        "",
        *tables(entries, "proof", TEN_AIMS, HIDDEN),
    ]


def page(now: list[Entry], before: list[Entry]) -> str:
    """The whole of RESULTS.md, of the run with all effects and of that with ten."""
    lines = [
        "# Results: the concealed-effect proof",
        "",
        "Rendered by `python -m benchmarks.concealed.render` from `benchmarks/results/`. Machines "
        "are drawn around a surrogate of the paper's lost Table I and two other sets, by a plant "
        "that shares no code with the package.",
        "",
        "E is the smallest squared distance, in noise units, that retuning the nominal machine "
        "leaves; E_sep is what is left of it beside the nearest rival. In hard cases the plant "
        "overstates both (docs/dev/PLAN.md). `right`: exactly the planted set named; `class`: "
        "`ambiguous` with the truth among its members; `abstained`: other doubts; `missed`: "
        "nothing found; `wrong`: confident and false. `E >= 1000` was asked of the plant; cases of "
        "700 and more count.",
        "",
        *(full(now) if now else []),
        *(again(anew) if (anew := outcomes(AGAIN)) else []),
        *others.section(outcomes(others.STEM)),
        *(line for stem in curves.ROUNDS for line in curves.section(outcomes(stem), stem)),
        *settled(),
        *(line for part in seeds.SEEDS for line in seeds.section(part)),
        *thresholds([*read(RESULTS / "earlier.jsonl"), *before], [*seeds.every(), *now]),
        *mechanisms(),
        *ten(before),
        *earlier(),
        "## Speed",
        "",
        *wall(),
        "In the proof, one diagnosis on one core over the length of its training recordings, other "
        f"work beside it: {speed(now or before)}.",
        "",
    ]
    return "\n".join(lines)


def score_in(readme: str) -> str:
    """README.md with the score over the seeds between its marks; as it is without any."""
    before, mark, rest = readme.partition(MARKS[0])
    _, end, after = rest.partition(MARKS[1])
    said = seeds.sentence()
    if not (mark and end and said):
        return readme
    return f"{before}{mark}\n{fill(said, 100)}\n{end}{after}"


def main() -> None:
    """Write RESULTS.md, and the score into README.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("RESULTS.md"))
    given, now, before = parser.parse_args(), outcomes("full"), outcomes("proof")
    given.out.write_text(page(now, before), encoding="utf-8")
    readme = Path("README.md")
    readme.write_text(score_in(readme.read_text(encoding="utf-8")), encoding="utf-8")
    print(json.dumps(Counter(e["outcome"] for e in now)))


if __name__ == "__main__":
    main()
