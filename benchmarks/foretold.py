"""Whether the sizes that ``corexy plan`` foretells are those that a diagnosis finds.

``python -m benchmarks.foretold [--minutes M]``: for every effect, at the first place where a size
is foretold, recordings of its program are made with 1.5 times that size and with 1/1.5 of it, and
diagnosed against all effects.  It goes on where it stopped; ``--render`` writes the page.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks.outcome import RESULTS, commit, keep_page
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.naming.plan_size import Nameable, stronger
from corexy_fmi.engine.planning.plan import smallest
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, Machine, load_machine
from corexy_fmi.programs import named_command, programs, stage_limits
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

STORE, PAGE = RESULTS / "foretold.jsonl", Path("docs/foretold.md")
COMMAND = "python -m benchmarks.foretold"
MACHINES, NOISE, SPEED, ACCELERATION, RATE = ("light_bench",), 2e-5, 0.1, 2.0, 1000.0
WITHIN = 1.5


def orders(machine: Machine) -> dict[str, Recording]:
    """The programs of `corexy plan` for a machine."""
    found = programs(stage_limits(machine, SPEED, ACCELERATION))
    return {n: named_command(f"{n}.csv", m, machine, RATE) for n, m in found.items()}


def foretold(name: str) -> list[Nameable]:
    """For each effect the first place with a size, else the first place."""
    machine = load_machine(name)
    with ThreadPoolExecutor(2) as pool:
        rows = smallest(bundled_layout(), machine, orders(machine), NOISE, pool.map)
    chosen: dict[str, Nameable] = {}
    for row in rows:
        if row.name not in chosen or chosen[row.name].size is None:
            chosen[row.name] = row
    return list(chosen.values())


def at(row: Nameable, share: float) -> dict[str, float]:
    """The parameters whose effect is ``share`` times the foretold one's, within their bounds."""
    instance = bundled_layout().find(row.name, row.location)
    return stronger(instance, row.others | {row.parameter: row.size or 0.0}, float(np.log(share)))


def recorded(row: Nameable, machine: Machine, values: dict[str, float], seed: int) -> Recording:
    """The row's program, run with the effect's parameters, and measured with noise."""
    use = EffectUse(row.name, row.location, values)
    order = orders(machine)[row.program]
    shown, random = simulate(replace(machine, effects=(use,)), order), np.random.default_rng(seed)
    measured = {n: shown[n] + NOISE * random.normal(size=len(shown)) for n in ("x", "y")}
    return replace(order, name=f"{seed}.csv", channels={**order.channels, **measured})


def tried(name: str, row: Nameable, share: float) -> dict[str, Any]:
    """What a diagnosis says of one size."""
    machine, values, begun = load_machine(name), at(row, share), time.monotonic()
    train, holdout = (recorded(row, machine, values, seed) for seed in (1, 2))
    said = diagnose([train], [holdout], machine, jobs=1).document
    named = [(e["name"], e["location"]) for e in said["effects"]]
    group = {(m["name"], m["location"]) for g in said["ambiguous_between"] for m in g}
    return {"machine": name, "share": share, "size": values[row.parameter], "row": asdict(row),
            "verdict": said["verdict"], "named": named, "group": sorted(group),
            "commit": commit(), "seconds": time.monotonic() - begun}  # fmt: skip


def kept() -> list[dict[str, Any]]:
    """What was tried so far."""
    return [json.loads(line) for line in STORE.read_text().splitlines()] if STORE.exists() else []


def outcome(entry: dict[str, Any]) -> str:
    """named: it alone; class: it among others; other words of a diagnosis."""
    truth = [entry["row"]["name"], entry["row"]["location"]]
    if entry["verdict"] == "explained":
        return "named" if [list(n) for n in entry["named"]] == [truth] else "wrong"
    if entry["verdict"] == "ambiguous" and truth in [list(g) for g in entry["group"]]:
        return "class"
    return str(entry["verdict"])


def page() -> str:
    """docs/foretold.md."""
    entries = kept()
    rows: dict[tuple[str, str], dict[float, dict[str, Any]]] = {}
    for e in entries:
        rows.setdefault((e["machine"], e["row"]["name"]), {})[e["share"]] = e
    both = {k: (v[WITHIN], v[1 / WITHIN]) for k, v in rows.items() if len(v) == 2}
    held = sum(outcome(a) == "named" and outcome(b) != "named" for a, b in both.values())
    above = sum(outcome(a) == "named" for a, _ in both.values())
    below = sum(outcome(b) != "named" for _, b in both.values())
    commits = ", ".join(sorted({e["commit"][:12] for e in entries}))
    lines = [
        "# Sizes that were foretold, and those that were found",
        "",
        f"`{COMMAND}`: programs and sizes of `corexy plan` ({NOISE * 1e6:g} um of white noise, "
        f"{SPEED:g} m/s, {ACCELERATION:g} m/s^2, {RATE:g} Hz) for each effect at the first place "
        "where a size is foretold. Two recordings of the program, one to fit, one kept back, are "
        f"made by our own kernel with {WITHIN:g} times that size, and with 1/{WITHIN:g} of it, and "
        f"diagnosed against all effects; engine {commits}.",
        "",
        f"Named alone at {WITHIN:g} times: {above} of {len(both)}. Not named alone at "
        f"1/{WITHIN:g}: {below} of {len(both)}. Both, so that the size found lies within "
        f"{WITHIN:g} times of the one foretold: {held} of {len(both)} (aim 90 %).",
        "",
        "The size was searched at the declared values of the other parameters, with the machine "
        "file taken as true; `named` asks for the verdict `explained`, confirmed on the recording "
        "kept back; `class` is `ambiguous` with the truth among its members.",
        "",
        f"| machine | effect | program | foretold | at {WITHIN:g} | at 1/{WITHIN:g} |",
        "|---|---|---|---|---|---|",
    ]
    for (machine, name), (a, b) in sorted(both.items()):
        row = a["row"]
        away = row["size"] - row["neutral"]
        told = f"{row['parameter']} {away:.3g} {row['unit']}"
        lines.append(
            f"| {machine} | {name} at {row['location']} | {row['program']} | {told} | "
            f"{outcome(a)} | {outcome(b)} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Try what was not tried yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1e9, help="begin nothing after this long")
    parser.add_argument("--render", action="store_true", help="only write the page")
    parser.add_argument("--check", action="store_true", help="only tell whether the page is stale")
    given, begun = parser.parse_args(), time.monotonic()
    if given.render or given.check:
        return keep_page(PAGE, page(), COMMAND, check=given.check)
    done = {(e["machine"], e["row"]["name"], e["share"]) for e in kept()}
    jobs = [(m, row, share) for m in MACHINES for row in foretold(m) if row.size is not None
            for share in (WITHIN, 1 / WITHIN)]  # fmt: skip
    for machine, row, share in track(jobs, description="sizes"):
        if time.monotonic() - begun > 60 * given.minutes:
            break
        if (machine, row.name, share) not in done:
            with STORE.open("a", encoding="utf-8") as out:
                out.write(json.dumps(tried(machine, row, share)) + "\n")
    return keep_page(PAGE, page(), COMMAND, check=False)


if __name__ == "__main__":
    raise SystemExit(main())
