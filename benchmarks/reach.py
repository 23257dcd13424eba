"""Are there causes that no fit reaches from the starts that their files declare?

    python -m benchmarks.reach [--machine yin2018] [--draws 1] [--target 1000] [--only NAME ...]

For every effect and place, parameters are drawn over the range of its starts and a little beyond,
its size so that it puts a squared distance E (``--target``) between machine and recording.  Both
are this package's own: nothing is concealed, it is a test of the search alone.  Told is what the
fits from the declared starts gain, beside what a fit from the truth does.  Writes
benchmarks/results/reach.json, a machine at a time.
"""

from __future__ import annotations

import argparse
import json
import zlib
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks.outcome import RESULTS, commit, write_outcome
from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.noise import white
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.rough import across
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.abreast import alone
from corexy_fmi.engine.naming.beyond import beyond
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.plan_size import sized
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.search import long_fit
from corexy_fmi.engine.naming.signature import changes, row_of
from corexy_fmi.engine.naming.spread import Spread, spread
from corexy_fmi.engine.planning.foresee import Sensing, filled, imagined
from corexy_fmi.engine.planning.plan import bare
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance, bundled_layout
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.programs import named_command, programs, stage_limits
from corexy_fmi.recording import Recording

PROGRAMS = ("strokes", "star")
STD, SPEED, ACCELERATION = 1e-5, 0.12, 3.0  # [m] of noise, [m/s], [m/s^2]
TARGET, TONES = 1000.0, (3.0, 60.0)  # E; [Hz] of what has a frequency in time
BEYOND, ASTRAY = 1.5, 0.1  # of the range of starts; std of the nominal numbers' logarithms
REACHED, FAINT = 0.8, 20.0  # share of the truth's gain; [nats] of a gain that tells nothing
COMMAND = "python -m benchmarks.reach"


def drawn(instance: Instance, offered: Spread, random: np.random.Generator) -> dict[str, float]:
    """Parameters within and a little beyond what an effect's fits begin from."""
    return {p.name: _value(p, instance, offered, random) for p in instance.effect.parameters}


def _value(p: Parameter, instance: Instance, offered: Spread, random: np.random.Generator) -> float:
    if p.shape or offered.drive not in p.drives:
        return p.starts[0] if p.default is None else p.default
    if p.periodic:
        return float(random.uniform(p.lower, p.upper))
    starts = TONES if p.over == "frequency" else offered.starts(instance, p)
    low, high = min(starts), max(starts)
    if p.log:
        value = float(np.exp(random.uniform(np.log(low / BEYOND), np.log(high * BEYOND))))
    else:
        value = float(random.uniform(low, high))
    return min(max(value, p.lower), p.upper)


def orders(machine: Machine) -> list[Recording]:
    """The commanded motions."""
    known = programs(stage_limits(machine, SPEED, ACCELERATION))
    return [named_command(f"{name}.csv", known[name], machine) for name in PROGRAMS]


def visible(
    machine: Machine, instance: Instance, random: np.random.Generator, target: float = TARGET
) -> dict[str, float] | None:
    """Drawn parameters of the size that shows by an E on the first motion; None where none does."""
    base = bare(machine, bundled_layout(), orders(machine)[0], STD)
    behind = beyond(base)
    problem = replace(base.problem, hypothesis=Hypothesis((instance,)))

    def share(values: dict[str, float]) -> tuple[float, list[Instance]]:
        row = row_of(problem, np.zeros(problem.size), instance, values)
        change = behind.off(alone(changes(base, problem, row[None])))[0]
        return float(np.sqrt(change @ change / target)), []

    start = drawn(instance, spread(base), random)
    found = sized(instance, start, PROGRAMS[0], share).row
    return None if found.size is None else found.others | {found.parameter: found.size}


def planted(
    machine: Machine, instance: Instance, values: dict[str, float], random: np.random.Generator
) -> tuple[Problem, Array]:
    """A problem whose runs show an effect on a machine that is a bit off, and the truth in it."""
    sensing = Sensing({c: white(STD) for c in ("x", "y")})
    runs = tuple(imagined(order, machine, sensing) for order in orders(machine))
    noise = tuple(tuple(white(STD) for _ in run.samples) for run in runs)
    asked = Problem(bundled_layout(), machine, runs, Hypothesis((instance,)), noise=noise)
    truth = np.zeros(asked.size)
    truth[: asked.nominal_count] = ASTRAY * random.normal(size=asked.nominal_count)
    truth = row_of(asked, truth, instance, values)
    shown = []
    for r, run in enumerate(runs):
        rows = asked.simulate(truth[None], r)[0]
        shown.append(filled(run, rows + STD * random.normal(size=rows.shape)))
    return replace(asked, runs=tuple(shown)), truth


def gains(problem: Problem, truth: Array) -> tuple[float, float]:
    """Nats over the retuned machine: of a fit from the truth, and of the best from the starts."""
    base = retune(problem.layout, problem.machine, problem.runs)
    asked = replace(base.problem, hypothesis=problem.hypothesis)
    known = across(minimise(asked, asked.carried(problem, truth), 10))
    lead = screen(base, [problem.hypothesis])[0]
    begun = [minimise(lead.problem, u, 5) for u in lead.starts]
    best = long_fit(min(begun, key=lambda fit: fit.cost))
    return base.cost - known.cost, base.cost - best.cost


def missed(row: dict[str, Any]) -> bool:
    """Whether the fits stay far behind the truth."""
    return bool(row["truth"] > FAINT and row["found"] < REACHED * row["truth"])


def rows(
    machine: Machine, draws: int, only: list[str], target: float = TARGET
) -> Iterator[dict[str, Any]]:
    """One row for each draw; no gains where no size within the effect's bounds shows enough."""
    asked = [i for i in instances(bundled_layout(), machine) if not only or i.effect.name in only]
    for instance in track(asked, "draws"):
        for n in range(draws):
            name = f"{instance.effect.name} at {instance.location}"
            random = np.random.default_rng([zlib.crc32(name.encode()), n])
            values = visible(machine, instance, random, target)
            row: dict[str, Any] = {"cause": name, "draw": n, "values": values}
            if values is not None:
                row["truth"], row["found"] = gains(*planted(machine, instance, values, random))
            yield row


def main() -> None:
    """Draw, fit, print what was missed, store."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machine", default="yin2018")
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--target", type=float, default=TARGET, help="E of what is planted")
    parser.add_argument("--only", nargs="*", default=[])
    given = parser.parse_args()
    found = list(rows(load_machine(given.machine), given.draws, given.only, given.target))
    shown = [row for row in found if row["values"] is not None]
    lost = [row for row in shown if missed(row)]
    for row in lost:
        print(f"{row['cause']}: {row['found']:.0f} of {row['truth']:.0f} nats, {row['values']}")
    print(f"{len(lost)} of {len(shown)} missed; {len(found) - len(shown)} cannot show that much")
    if not given.only:
        store = RESULTS / "reach.json"
        known = json.loads(store.read_text(encoding="utf-8")) if store.is_file() else {}
        told = {"commit": commit(), "target": given.target, "rows": found}
        machines = known.get("machines", {}) | {given.machine: told}
        print(write_outcome("reach", COMMAND, {"machines": machines}))


if __name__ == "__main__":
    main()
