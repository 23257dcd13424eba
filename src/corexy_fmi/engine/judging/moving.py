"""Recordings that begin in motion: the inputs alone do not tell, their first moments do.

A commanded ramp at the first row may be a start from rest (as the contract has it), or the middle
of a stroke whose beginning nobody kept; and where the inputs rest, the stage may still swing.  Both
are replayed over the first half second with the machine as given; the run begins in motion where
that leaves clearly less.  It is then led in at the rate of its first interval, and how far x, y,
motors that voltages turn, and their speeds are off such an even motion is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fitting.holding import speeds
from corexy_fmi.engine.fitting.noise import Noise, quick_noise, white
from corexy_fmi.engine.judging.prove import replay
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine

STILL = 0.01  # share of the fastest speed below which the inputs stand still
LEAD, WAY, SHORTEST = 0.5, 0.02, 0.1  # [s] of the lead-in, or as long as this way [m] takes; [s]
LOOK, LEFT, GAIN = 0.5, 0.8, 10.0  # [s] looked at; share left of the mean square; [nats]
FEWEST = 10  # samples that tell


def begun(runs: Sequence[Run], layout: Layout, machine: Machine) -> list[Run]:
    """The runs, those that begin in motion with their lead-in."""
    return [_begun(run, layout, machine) for run in runs]


def begun_alike(parts: Sequence[Run], known: Sequence[Run]) -> list[Run]:
    """Other parts of some of the same recordings as those begin."""
    pairs = ((part, run) for part in parts for run in known if run.recording is part.recording)
    return [replace(run, role=part.role, samples=part.samples) for part, run in pairs]


def told(runs: Sequence[Run]) -> list[Finding]:
    """What to say of recordings that begin in motion."""
    fix = "Its first state is left free; a start at rest tells more of the machine."
    names = dict.fromkeys(run.name for run in runs if run.moving)
    return [Finding(f"{name}: begins in motion", fix) for name in names]


def _begun(run: Run, layout: Layout, machine: Machine) -> Run:
    e = run.excitation
    if run.clock_free or e.mode == "voltages" or len(e.time) < FEWEST:
        return run
    speed = speeds(machine, e)
    lead = max(min(LEAD, WAY / max(float(speed[0]), 1e-9)), SHORTEST)
    moving = replace(run, excitation=replace(e, lead=lead), pace=float(speed.max()))
    first = [_first(r, _looked(e.time, speed)) for r in (run, moving)]
    return moving if _better(layout, machine, *first) else run


def _looked(time: Array, speed: Array) -> float:
    """Seconds that tell: where the inputs stand still at first, until they move."""
    moves = np.flatnonzero(speed > STILL * speed.max())
    still = float(time[moves[0]] - time[0]) if len(moves) else LOOK
    return min(still, LOOK) if still > 0 else LOOK


def _first(run: Run, seconds: float) -> Run:
    """The first seconds of a run, from its first sample on."""
    e = run.excitation
    began = min((int(s.index[0]) for s in run.samples), default=0)
    rows = int(np.searchsorted(e.time, e.time[began] + seconds))
    short = replace(e, time=e.time[:rows], input1=e.input1[:rows], input2=e.input2[:rows])
    samples = [s.without(s.index >= rows) for s in run.samples]
    kept = tuple(s for s in samples if len(s.index) >= FEWEST)
    return replace(run, excitation=short, samples=kept)


def _better(layout: Layout, machine: Machine, still: Run, moving: Run) -> bool:
    """Whether a begin in motion leaves clearly less than one at rest."""
    if not moving.samples:
        return False
    noise = tuple(white(quick_noise(s)) for s in moving.samples)
    squares = [_squares(layout, machine, run, noise) for run in (still, moving)]
    if not np.isfinite(squares).all() or squares[1] >= LEFT * squares[0]:  # both may be 0
        return False
    return 0.5 * moving.count * float(np.log(squares[0] / max(squares[1], 1e-300))) > GAIN


def _squares(layout: Layout, machine: Machine, run: Run, noise: tuple[Noise, ...]) -> float:
    """Sum of squares of what a replay leaves, in noise units."""
    found = replay(layout, machine, run, noise)
    return float(
        sum(np.sum((e / n.marginal) ** 2) for e, n in zip(found.errors, noise, strict=True))
    )
