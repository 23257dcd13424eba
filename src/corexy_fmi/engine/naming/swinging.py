"""A force in time does not wait for the first row: the stage may swing already when it comes.

Runs begin at rest (CONTRACT 2), and a fan or a pump that shakes the stage since before would have
to start with them; something else then makes up for the first strokes.  For a force of 7 N that
cost 375 nats, of which a cable beside it won back 305.  So a fit with a force in time that gains a
fair share is also led in: held where its inputs begin, under its force, until the stage swings as
it will.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fitting.clock import moves_at_first
from corexy_fmi.engine.fitting.fit import AGAIN, Fit, Mapper, minimise, settle
from corexy_fmi.engine.naming.again import BETTER
from corexy_fmi.engine.naming.quietest import contenders
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.kernel.layout import Instance
from corexy_fmi.kernel.trace import argument_names

LEAD = 1.0  # [s] in which a stage comes to swing evenly
FORCES = {"applied_force", "rotor_torque"}


def swinging(base: Fit, fits: list[Fit], mapper: Mapper) -> tuple[Fit, list[Fit]]:
    """The retuned machine and the fits, best first, all led in where one with a force in time that
    gains a fair share asks for it; as they are anywhere else.
    """
    runs = tuple(held(run) for run in base.problem.runs)
    if all(a is b for a, b in zip(runs, base.problem.runs, strict=True)):
        return base, fits
    able = [f for f in contenders(base, fits) if any(map(_in_time, f.problem.hypothesis.uses))]
    again = list(mapper(lambda f: settle(_led(f, runs, AGAIN)), able))
    if not any(a.cost < f.cost - BETTER for a, f in zip(again, able, strict=True)):
        return base, fits
    known = dict(zip(map(id, able), again, strict=True))
    others = [f for f in fits if id(f) not in known]
    led = [*again, *mapper(lambda f: _led(f, runs, 0), others)]
    return settle(_led(base, runs, AGAIN)), sorted(led, key=rank)


def held(run: Run) -> Run:
    """The run, held for `LEAD` seconds where it begins; as it is where its inputs move at first, or
    voltages drive it.
    """
    e = run.excitation
    if e.lead > 0 or e.mode == "voltages" or len(e.time) < 2 or moves_at_first(run):
        return run
    return replace(run, excitation=replace(e, lead=LEAD))


def alike(runs: Sequence[Run], base: Fit) -> list[Run]:
    """Other runs, led in if those of a fit are."""
    return [held(run) for run in runs] if _are_held(base) else list(runs)


def told(base: Fit) -> list[Finding]:
    """What is to be said of runs that were led in."""
    text = "a force in time shakes the stage since before the first row: it swings already there"
    return [Finding(text, "Each recording is led in at rest under that force.")] * _are_held(base)


def _are_held(base: Fit) -> bool:
    return any(run.excitation.lead > 0 and not run.moving for run in base.problem.runs)


def _in_time(instance: Instance) -> bool:
    """Whether an effect is a force that tells the time, whatever moves."""
    reads = (set(argument_names(law.function)) for law in instance.effect.laws)
    return any("now" in names and names & FORCES for names in reads)


def _led(fit: Fit, runs: tuple[Run, ...], iterations: int) -> Fit:
    return minimise(replace(fit.problem, runs=runs), fit.u, iterations)
