"""Whether an effect as strong as its bound lies below it as often as the bound says.

``python -m benchmarks.untold`` bounds every effect, at its first place, on recordings in which
nothing is missing, plants it with that size, and counts how often the bound of the recording with
it in lies above what was planted; ``--render`` writes docs/untold.md from the stored counts.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track
from scipy.stats import binomtest

from benchmarks.outcome import RESULTS, keep_page, write_outcome
from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect
from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.naming import untold
from corexy_fmi.engine.naming.plan_size import stronger
from corexy_fmi.engine.naming.screen import bounds
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, Machine, load_machine
from corexy_fmi.motion import chain, circle, command, line, rest
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

COMMAND = "python -m benchmarks.untold"
STORE, PAGE = RESULTS / "untold.json", Path("docs/untold.md")
MACHINE, NOISE, SEEDS, ROUNDS = "light_bench", 2e-5, 20, 8
CORNERS = ((0, 0), (0.03, 0), (0.03, 0.02), (0, 0.02), (-0.02, -0.01), (0, 0))  # [m]
SPEEDS = (0.08, 0.05, 0.1, 0.06, 0.03)  # [m/s]


@cache
def nominal(drive: str) -> Machine:
    """The bench, or for a dc drive yin2018_dc."""
    bench, other = load_machine(MACHINE), load_machine("yin2018_dc")
    return bench if drive == bench.drive else other


@cache
def order(drive: str) -> Recording:
    """Straight moves at five speeds and a circle, 1 kHz."""
    legs = zip(CORNERS, CORNERS[1:], SPEEDS, strict=False)
    moves = [line(a, b, speed, 2.0) for a, b, speed in legs]
    motion = chain(rest((0, 0), 0.1), *moves, circle(0.01, 0.06, 1, 2.0), rest((0, 0), 0.3))
    found = command(motion, nominal(drive).parameters["pulley_radius"], name="run.csv")
    loop = nominal(drive).controller
    about = {"controller": f"pd kp={loop.kp!r} kd={loop.kd!r}"} if loop else {}
    return replace(found, metadata=about)


def recorded(truth: Machine, seed: int) -> Recording:
    """The run with white noise."""
    given, random = order(truth.drive), np.random.default_rng(seed)
    shown = simulate(truth, given)
    measured = {n: shown[n] + NOISE * random.normal(size=len(shown)) for n in ("x", "y")}
    volts = {n: shown[n] for n in ("V1", "V2") if truth.controller}
    return replace(given, channels={**given.channels, **volts, **measured})


def retuned(recording: Recording, drive: str) -> Fit:
    """The machine retuned to a recording."""
    run = make_run(recording, nominal(drive), "train")
    white = tuple(Noise(np.zeros(0), NOISE, NOISE) for _ in run.samples)
    problem = Problem(bundled_layout(), nominal(drive), (run,), noise=(white,))
    return minimise(problem, np.zeros(problem.size), ROUNDS)


def bound(fit: Fit, name: str, place: str) -> float:
    """The largest strength of an effect that is not told."""
    (lead,) = bounds(fit, [bundled_layout().find(name, place)])
    return lead.bound


def planted(effect: Effect, strength: float, seed: int = 0) -> dict[str, float]:
    """The effect's parameters with that strength, the others where its file begins them; what
    happens at some time anywhere in the recording.
    """
    instance = bundled_layout().find(effect.name, next(iter(effect.locations)))
    start = {p.name: p.starts[0] for p in effect.parameters if not p.initial}
    last = order(effect.drives[0]).time[-1]
    when = float(np.random.default_rng((seed, 1)).uniform(0, last))
    start |= {p.name: when for p in effect.parameters if p.over == "time"}
    own = untold.strength(effect.size, start[effect.size.name])
    return stronger(instance, start, float(np.log(strength / own)))


def counted(effect: Effect) -> dict[str, Any]:
    """How often the bound lies above what was planted."""
    place, drive = next(iter(effect.locations)), effect.drives[0]
    strength = bound(retuned(recorded(nominal(drive), 0), drive), effect.name, place)
    size = effect.size
    row = {"effect": effect.name, "place": place, "unit": size.unit_at(place)}
    found = []
    for seed in range(1, SEEDS + 1):
        use = EffectUse(effect.name, place, planted(effect, strength, seed))
        truth = replace(nominal(drive), effects=(use,))
        found.append(bound(retuned(recorded(truth, seed), drive), effect.name, place) / strength)
    told = {"above": sum(s >= 1 for s in found), "median": float(np.median(found))}
    return row | {"size": planted(effect, strength)[size.name]} | told


def page() -> str:
    """docs/untold.md."""
    told = json.loads(STORE.read_text(encoding="utf-8"))
    rows = told["rows"]
    above, of = sum(r["above"] for r in rows), SEEDS * len(rows)
    low, high = binomtest(above, of).proportion_ci(method="wilson")
    share = f"{above} of {of} = {above / of:.1%} [{low:.1%}, {high:.1%}]"
    lines = [
        "# Bounds on what was not named",
        "",
        f"`{told['command']}` at commit {told['commit'][:12]}: each effect, at its first place, is "
        f"bounded (`not_excluded`, 95 %) on a recording of {MACHINE} in which nothing is missing "
        "(dc effects: yin2018_dc), then planted with that size, its other parameters where its "
        "file begins them, what happens at some time anywhere in the recording, and bounded on "
        f"{SEEDS} recordings with it in, the machine retuned to each. x and y at 1 kHz with "
        f"{1e6 * NOISE:g} um of white noise. The bound lay above what was planted in {share} "
        "(95 % asked).",
        "",
        "A median far above 1.6 bounds too loosely: a soft rotor or a light tool is another stage, "
        "told or not. Below 1 it is too tight: the bound is that of the time or shape told least, "
        "another one was planted.",
        "",
        "| effect | planted | bound above it | bound over planted, median |",
        "|---|---|---|---|",
        *map(_line, rows),
    ]
    return "\n".join(lines) + "\n"


def _line(row: dict[str, Any]) -> str:
    size = f"{row['size']:.3g} {row['unit']}"
    where = f"{row['effect']} at {row['place']}"
    return f"| {where} | {size} | {row['above']} of {SEEDS} | {row['median']:.2f} |"


def main() -> int:
    """Count, store, render."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--render", action="store_true", help="only write the page")
    parser.add_argument("--check", action="store_true", help="only tell whether the page is stale")
    given = parser.parse_args()
    if not (given.render or given.check):
        effects = list(catalogue().values())
        with ThreadPoolExecutor(2) as pool:
            done = pool.map(counted, effects)
            rows = list(track(done, description="effects", total=len(effects)))
        write_outcome("untold", COMMAND, {"rows": rows})
    return keep_page(PAGE, page(), COMMAND, check=given.check)


if __name__ == "__main__":
    raise SystemExit(main())
