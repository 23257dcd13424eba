"""The next experiment: of some short programs the one that parts rivals soonest (T-optimal design,
Atkinson and Fedorov, Biometrika 1975, doi:10.1093/biomet/62.1.57).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

from corexy_fmi.engine.data.samples import LONG
from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.judging.local import is_local
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming.entries import THRESHOLD, Competition
from corexy_fmi.engine.planning.bearable import bears, strain
from corexy_fmi.engine.planning.foresee import Sensing, imagined
from corexy_fmi.engine.planning.parted import Foretold, Parted
from corexy_fmi.errors import InputError
from corexy_fmi.files import PROGRAM
from corexy_fmi.machine import Machine
from corexy_fmi.programs import Limits, named_command, programs, recorded_limits, shakings
from corexy_fmi.recording import Recording, controller

RIVALS = 4
SETTLES = 30.0  # [1] E_sep: 15 +- 5.5 nats for the true one, 2.9 TEMPERATURE + 5.5 are needed
MOST = 20  # repeats
UNSEEN = ", given with --holdout: what was kept back hardly shows the cause"
TRIES = 3  # programs whose promise is looked into


@dataclass(frozen=True, eq=False)
class Experiment:
    """A program for the machine, and why: ``order`` holds phi1, phi2 [rad]; run ``times`` times it
    should settle the verdict, None where no number up to ``MOST`` does; ``kept_back``, as data that
    judge, where those that did show nothing.
    """

    order: Recording
    why: str
    times: int | None = None
    kept_back: bool = False


def rivals(verdict: Verdict, competition: Competition) -> list[Fit]:
    """The fits that the data left side by side; without effects too where its class is listed.

    What belongs to one recording (`local.py`) foretells nothing of another, and is left out.
    """
    wanted = [key for group in verdict.classes for key in group]
    listed = [e for e in competition.entries if e.hypothesis.key and e.hypothesis.key in wanted]
    found = [e.fit for e in listed if not is_local(e.fit)]
    weak = verdict.entry is not None and verdict.entry.gain < THRESHOLD
    return [*found[:RIVALS], *([competition.retuned] if () in wanted or weak else [])]


def next_experiment(
    verdict: Verdict, competition: Competition, machine: Machine, mapper: Mapper
) -> Experiment | None:
    """The program that separates an ambiguous verdict's rivals best; None for other verdicts.

    It goes no farther, no faster and no harder than the recordings did, and is none that a rival
    foretells to be unbearable (`bearable.py`).
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
    orders = _orders(limits, machine)
    sensing, seen = Sensing.like(competition.retuned), strain(competition.retuned)

    def apart(harder: list[Recording]) -> tuple[Recording, list[Parted]]:
        """The hardest that every rival bears, and how far it parts them."""
        for order in harder:
            run = imagined(order, _with_loop(machine, recordings), sensing)
            if all(bears(fit, run, sensing, seen) for fit in fits):
                told = [Foretold.by(fit, run, sensing) for fit in fits]
                return order, [Parted(a, b) for a, b in combinations(told, 2)]
        return harder[0], []

    chosen, parted = zip(*mapper(apart, list(orders.values())), strict=True)
    most = _most(competition.retuned, chosen[0])
    if not any(parted) or most < 1:
        return None
    best, (times, told) = _soonest(parted, most, mapper)
    why = _why(list(orders)[best], fits, told, times, most)
    if times > most:
        return Experiment(chosen[best], why)
    why += UNSEEN if verdict.unseen else ""
    return Experiment(chosen[best], why, times, verdict.unseen)


def _orders(limits: Limits, machine: Machine) -> dict[str, list[Recording]]:
    """All programs by name, each from hard to soft."""
    found = {name: (motion,) for name, motion in programs(limits).items()} | shakings(limits)
    return {
        k: [named_command(PROGRAM, m, machine) for m in motions] for k, motions in found.items()
    }


def _soonest(
    parted: Sequence[list[Parted]], most: int, mapper: Mapper
) -> tuple[int, tuple[int, float]]:
    """Which program settles soonest, and what `_enough` says of it: those that promise most by
    linear models are asked what is left of it once the rivals have given way.
    """
    promised = {n: _enough(pairs, most) for n, pairs in enumerate(parted) if pairs}
    found: dict[int, tuple[int, float]] = {}
    for n in sorted(promised, key=lambda n: _sooner(promised[n]))[:TRIES]:
        pairs = parted[n]
        for times in (most, min(promised[n][0], most)):
            pairs = list(mapper(partial(Parted.given_way, times=times), pairs))
        found[n] = _enough(pairs, most)
        if found[n][0] <= most:
            break
    best = min(found, key=lambda n: _sooner(found[n]))
    return best, found[best]


def _sooner(enough: tuple[int, float]) -> tuple[int, float]:
    """Less of two programs is the one of fewer runs, or that parts farther."""
    return enough[0], -enough[1]


def _most(fit: Fit, order: Recording) -> int:
    """Repeats that are still fitted whole, beside what was recorded."""
    rows = sum(len(run.excitation.time) for run in fit.problem.runs)
    return min(MOST, (LONG - rows) // len(order.time))


def _enough(pairs: list[Parted], most: int) -> tuple[int, float]:
    """How often a program must run to settle, and the least E_sep then; else of the most."""
    least = 0.0
    for times in range(1, most + 1):
        least = min(pair.distance(times) for pair in pairs)
        if least >= SETTLES:
            return times, least
    return most + 1, least


def _with_loop(machine: Machine, recordings: list[Recording]) -> Machine:
    """The machine with the loop that its recordings were run in."""
    return replace(machine, controller=controller(recordings[0]) or machine.controller)


def _why(name: str, fits: list[Fit], parted: float, times: int, most: int) -> str:
    labels = [f.problem.hypothesis.label if f.problem.hypothesis.key else "retuned parameters"
              for f in fits]  # fmt: skip
    told = f"{', '.join(labels[:-1])} and {labels[-1]}"
    if times > most:
        return (
            f"even {most} runs of the {name} hardly part {told}: "
            f"{parted:.1f} noise units squared at least"
        )
    repeat = "once is enough" if times == 1 else f"run it {times} times"
    return f"the {name} part {told} by {parted:.0f} noise units squared at least; {repeat}"
