"""The next experiment: of some short programs the one that parts rivals soonest (T-optimal design,
Atkinson and Fedorov, Biometrika 1975, doi:10.1093/biomet/62.1.57).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from corexy_fmi.effects.api import ROTOR_TEETH, STEPPER
from corexy_fmi.engine.entries import THRESHOLD, Competition
from corexy_fmi.engine.fit import Fit, Mapper
from corexy_fmi.engine.foresee import Parted, Sensing, imagined, onto, parting, placed
from corexy_fmi.engine.local import is_local
from corexy_fmi.engine.samples import LONG, Run
from corexy_fmi.engine.verdict import Verdict
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.programs import named_command, programs, recorded_limits
from corexy_fmi.recording import Recording, controller

FILE = "next_experiment.csv"
RIVALS = 4
SETTLES = 30.0  # [1] E_sep: 15 +- 5.5 nats for the true one, 2.9 TEMPERATURE + 5.5 are needed
MOST = 20  # repeats
HALF_CYCLE = np.pi / ROTOR_TEETH  # [rad] behind its field, where a rotor is let go


@dataclass(frozen=True, eq=False)
class Experiment:
    """A program for the machine, and why: ``order`` holds phi1, phi2 [rad]; run ``times`` times it
    should settle the verdict, None where no number up to ``MOST`` does.
    """

    order: Recording
    why: str
    times: int | None = None


def rivals(verdict: Verdict, competition: Competition) -> list[Fit]:
    """The fits that the data left side by side; without effects too where its class is listed.

    What belongs to one recording (`local.py`) foretells nothing of another, and is left out.
    """
    wanted = [key for group in verdict.classes for key in group]
    listed = [e for e in competition.entries if e.hypothesis.key in wanted and e.hypothesis.uses]
    found = [e.fit for e in listed if not is_local(e.fit)]
    weak = verdict.entry is not None and verdict.entry.gain < THRESHOLD
    return [*found[:RIVALS], *([competition.retuned] if () in wanted or weak else [])]


def next_experiment(
    verdict: Verdict, competition: Competition, machine: Machine, mapper: Mapper
) -> Experiment | None:
    """The program that separates an ambiguous verdict's rivals best; None for other verdicts.

    It goes no farther, no faster and no harder than the recordings did, and is none on which a
    rival's rotor would fall out of step: what follows tells of lost steps, not of what was missing.
    """
    if verdict.word != "ambiguous":
        return None
    fits = rivals(verdict, competition)
    recordings = [run.recording for run in competition.retuned.problem.runs]
    driven = all("phi1" in r for r in recordings)
    planar = machine.topology == "corexy" and machine.fidelity != "kinematic"
    if len(fits) < 2 or not driven or not planar:
        return None
    try:
        limits = recorded_limits(recordings, machine)
    except InputError:  # nothing moved
        return None
    names, motions = zip(*programs(limits).items(), strict=True)
    orders = [named_command(FILE, motion, machine) for motion in motions]
    sensing = Sensing.like(competition.retuned)

    def apart(order: Recording) -> list[Parted]:
        run = imagined(order, _with_loop(machine, recordings), sensing)
        if any(falls_out(fit, run, sensing) for fit in fits):
            return []
        return [parting(a, b, run, sensing) for a, b in permutations(fits, 2)]

    parted = list(mapper(apart, orders))
    most = _most(competition.retuned, orders[0])
    found = [_enough(pairs, most) for pairs in parted]
    best = max(range(len(found)), key=lambda n: (-found[n][0], found[n][1]))
    if not parted[best] or most < 1:
        return None
    times, told = found[best]
    why = _why(names[best], fits, told, times, most)
    return Experiment(orders[best], why, times if times <= most else None)


def _most(fit: Fit, order: Recording) -> int:
    """Repeats that are still fitted whole, beside what was recorded."""
    rows = sum(len(run.excitation.time) for run in fit.problem.runs)
    return min(MOST, (LONG - rows) // len(order.time))


def _enough(pairs: list[Parted], most: int) -> tuple[int, float]:
    """How often a program must run to settle, and the least E_sep then; else of the most."""
    least = 0.0
    for times in range(1, most + 1 if pairs else 1):
        least = min(pair.distance(times) for pair in pairs)
        if least >= SETTLES:
            return times, least
    return most + 1, least


def falls_out(fit: Fit, run: Run, sensing: Sensing) -> bool:
    """Whether a stepper's rotor, by a fit, leaves the field that turns it on an imagined run."""
    problem = onto(fit, run, sensing)
    if problem.machine.drive != STEPPER:
        return False
    turned = problem.simulate(placed(fit, problem)[None], 0, ("phi1", "phi2"))[0]
    asked = np.array([run.excitation.input1, run.excitation.input2])
    return not bool(np.abs(turned - asked).max() < HALF_CYCLE)


def _with_loop(machine: Machine, recordings: list[Recording]) -> Machine:
    """The machine with the loop that its recordings were run in."""
    return replace(machine, controller=controller(recordings[0]) or machine.controller)


def _why(name: str, fits: list[Fit], parted: float, times: int, most: int) -> str:
    labels = [f.problem.hypothesis.label if f.problem.hypothesis.uses else "retuned parameters"
              for f in fits]  # fmt: skip
    told = f"{', '.join(labels[:-1])} and {labels[-1]}"
    if times > most:
        return (
            f"even {most} runs of the {name} hardly part {told}: "
            f"{parted:.1f} noise units squared at least"
        )
    repeat = "once is enough" if times == 1 else f"run it {times} times"
    return f"the {name} part {told} by {parted:.0f} noise units squared at least; {repeat}"
