"""How often do intervals hold the truth: by curvature, under looser priors, and walked?

    python -m benchmarks.walked [--draws 10] [--only NAME ...]

Effects that have a parameter on a logarithmic scale are planted in machines that are off their
file, as large as E of about 1000 (`reach.py`; machine and recording are this package's own), and
fitted from parameters that are off.  Told is how many of the parameters whose interval was walked
lie in it, and by how much walking widens it.  Writes benchmarks/results/walked.json.
"""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks.outcome import write_outcome
from benchmarks.reach import planted, visible
from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.looser import loosened
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.judging.model import covariance, effect_table, ends
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.telling.walked import walked
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance, bundled_layout
from corexy_fmi.machine import Machine, load_machine

OFF = 0.7  # std of the logarithms that a fit begins off the truth
ITERATIONS, ELSEWHERE = 25, 2.0  # of a fit; [nats] by which it ends dearer in another minimum
COMMAND = "python -m benchmarks.walked"


def asked(machine: Machine, only: list[str]) -> list[Instance]:
    """Each effect with a parameter that may be walked, at its first place."""
    found: dict[str, Instance] = {}
    for instance in instances(bundled_layout(), machine):
        if any(p.log and not p.over for p in instance.effect.parameters):
            found.setdefault(instance.effect.name, instance)
    return [i for name, i in found.items() if not only or name in only]


def begun_off(problem: Problem, truth: Array, random: np.random.Generator) -> Fit | None:
    """A fit from where the effect's parameters are off; None where it ends in another minimum."""
    start = truth.copy()
    for k, unknown in enumerate(problem.unknowns):
        if unknown.log and "." in unknown.key and not unknown.wave:
            start[k] += OFF * random.normal()
    best, found = (minimise(problem, u, ITERATIONS) for u in (truth, start))
    return found if found.cost < best.cost + ELSEWHERE else None


def judged(fit: Fit, truth: Array) -> dict[str, Any]:
    """For each parameter that was walked whether its interval holds the truth, in each way to tell
    it, and how far it reaches; and what walking took [s].
    """
    (instance,), begun = fit.problem.hypothesis.uses, time.process_time()
    reached = walked(fit, map)
    taken = time.process_time() - begun
    loose = [ends(wide)] if (wide := loosened(fit)) else []
    key, spread = (instance.effect.name, instance.location), covariance(fit)
    tables = [effect_table(fit, *key, spread, f) for f in ([], loose, [*loose, reached])]
    found = []
    for name in reached:
        k = fit.problem.keys.index(name)
        true = float(fit.problem.unknowns[k].value(truth[k]))
        told = [table[name.split(".")[-1]]["ci95"] for table in tables]
        inside = [low <= true <= high for low, high in told]
        found.append({"key": name, "inside": inside, "width": [np.log(h / low) for low, h in told]})
    return {"parameters": found, "taken": taken}


def rows(machine: Machine, draws: int, only: list[str]) -> Iterator[dict[str, Any]]:
    """One for each draw whose effect shows and whose fit ends where the truth's does."""
    for instance in track(asked(machine, only), "effects"):
        for n in range(draws):
            name = f"{instance.effect.name} at {instance.location}"
            random = np.random.default_rng([zlib.crc32(name.encode()), n])
            values = visible(machine, instance, random)
            if values is None:
                continue
            problem, truth = planted(machine, instance, values, random)
            fit = begun_off(problem, truth, random)
            yield {"cause": name, "draw": n} | (judged(fit, truth) if fit else {})


def told(found: list[dict[str, Any]]) -> str:
    """A line of what came out."""
    fits = [row for row in found if "taken" in row]
    each = [p for row in fits for p in row["parameters"]]
    held = [sum(p["inside"][k] for p in each) for k in range(3)]
    wider = np.exp([p["width"][2] - p["width"][1] for p in each])
    return (
        f"{len(fits)} of {len(found)} fits ended where the truth's does; of {len(each)} parameters "
        f"whose interval was walked {held[0]} lie in it by curvature, {held[1]} under looser "
        f"priors, {held[2]} as walked; its ends are further apart by a factor of "
        f"{np.median(wider):.2f} in the median, {np.quantile(wider, 0.9):.3g} in the widest tenth; "
        f"{np.mean([row['taken'] for row in fits]):.1f} s of CPU each"
    )


def main() -> None:
    """Draw, fit, tell, store."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--only", nargs="*", default=[])
    given = parser.parse_args()
    found = list(rows(load_machine("yin2018"), given.draws, given.only))
    print(told(found))
    if not given.only:
        print(write_outcome("walked", COMMAND, {"told": told(found), "rows": found}))


if __name__ == "__main__":
    main()
