"""The section of RESULTS.md on causes that are mechanisms in MuJoCo."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from benchmarks.mechanism.mechanisms import MECHANISMS
from benchmarks.mechanism.store import read

Entry = Mapping[str, Any]


def _named(entry: Entry) -> str:
    effects = entry["document"]["effects"]
    return " + ".join(f"{e['name']} at {e['location']}" for e in effects) or "-"


def _rms(entry: Entry) -> str:
    held = entry["document"]["heldout"]
    keys = ("rms_nominal", "rms_retuned", "rms_explained")
    return " / ".join(f"{1e6 * held[k]:.1f}" for k in keys)


def agreement(rows: list[Entry]) -> list[str]:
    """How near kernel and MuJoCo are: bare, and each mechanism beside its effect, unfitted."""
    table = [
        "| in MuJoCo | machine | size | does [um rms] | its effect leaves [um rms] | most [um] |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        kind = MECHANISMS.get(row["mechanism"])
        built = f"{kind.built} ({kind.effect})" if kind else "nothing"
        does, effect = row["does"]["rms"], row["effect"]
        cells = (built, row["machine"], row["size"], f"{does:.2f}")
        left = f"{effect['rms']:.3f}", f"{effect['largest']:.2f}"
        table.append(f"| {' | '.join((*cells, *left))} |")
    return table


def cases(entries: list[Entry]) -> list[str]:
    """Every sealed case."""
    table = [
        "| case | truth | size | machine | noise [um] | outcome | said | held out [um] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for e in entries:
        truth, noise = e["truth"], e["truth"]["noise"]
        planted = " + ".join(f"{p['name']} at {p['location']}" for p in truth["effects"]) or "-"
        colour = f"{1e6 * noise['sigma']:.1f}" + (f", rho {noise['rho']:.1f}" * (noise["rho"] > 0))
        said = f"{e['document']['verdict']}: {_named(e)}"
        cells = (
            e["name"], planted, truth["size"], truth["base"], colour, e["outcome"], said, _rms(e)
        )  # fmt: skip
        table.append(f"| {' | '.join(cells)} |")
    return table


def _origins(kept: Mapping[str, Any]) -> list[str]:
    """What the seeds of each run follow from, the newest run first."""
    entries = [*kept.get("cases", []), *kept.get("seals", [])]
    return list(dict.fromkeys(e["origin"] for e in entries))[::-1]


def run(kept: Mapping[str, Any], origin: str) -> list[str]:
    """One engine's cases: counts and a row for each."""
    entries = [e for e in kept.get("cases", []) if e["origin"] == origin]
    said = Counter(e["outcome"] for e in entries if e["truth"]["kind"] == "effect")
    nulls = Counter(e["outcome"] for e in entries if e["truth"]["kind"] == "null")
    commits = ", ".join(sorted({e["commit"][:12] for e in entries}))
    seconds = sorted(e["seconds"]["diagnose"] for e in entries)
    done = {e["name"] for e in entries}
    sealed = [s["name"] for s in kept.get("seals", []) if s["origin"] == origin]
    cut = [name for name in sealed if name not in done]
    took = f"{seconds[0]:.0f} to {seconds[-1]:.0f} s" if seconds else "-"
    return [
        f"Engine {commits}: {sum(said.values())} mechanisms: {_counts(said)}."
        f" {sum(nulls.values())} nulls: {_counts(nulls)}."
        + (f" Sealed but cut off by the clock: {', '.join(cut)}." if cut else "")
        + f" One diagnosis took {took} on two cores that other work shared.",
        "",
        *cases(entries),
        "",
    ]


def section(kept: Mapping[str, Any] | None = None) -> list[str]:
    """The lines of the section; none where nothing was run."""
    kept = read() if kept is None else kept
    if not kept.get("cases", []):
        return []
    return [
        "## Causes by mechanism, in a simulator of others",
        "",
        "The stage as a tree of bodies in MuJoCo, which nobody here wrote, with a mechanism in it",
        "(benchmarks/mechanism): gravity that leans, a pin in a slot, a bridge on a hinge, a frame",
        "and a tool on springs, tendons of unequal stiffness or with damping. Drawn by seed and",
        "sealed as above, true parameters 10 to 20 % off the file, 1 kHz, **all 35 effects**",
        "**competing**; `python -m benchmarks.mechanism.proof`.",
        "A constant load only moves the place where springs rest: tilted stages, and half of the",
        "nulls, are recorded with the inputs' zero (`zero: x, y`). E is not known here. Few cases:",
        "examples, not rates. Held out: rms as given / retuned / explained. Newest run first.",
        "The runs of d3e9f2f and fe995d1 used a friction of MuJoCo's that creeps, by tens of um",
        "under a frame that rings: their frames held more than a frame does, and two of three were",
        "left open. Later ones take the creep away (`noslip_iterations`).",
        "",
        *(line for origin in _origins(kept) for line in run(kept, origin)),
        "How near the two simulators are, at the true parameters, nothing fitted",
        "(`python -m benchmarks.mechanism.agree`; offsets left out but for tilt):",
        "",
        *agreement(kept.get("agreement", [])),
        "",
    ]  # fmt: skip


def _counts(said: Counter[str]) -> str:
    return ", ".join(f"{n} {outcome}" for outcome, n in said.most_common()) or "none run"
