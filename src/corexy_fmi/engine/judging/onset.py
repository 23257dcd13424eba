"""Recordings of voltages alone that begin in motion: their first moments are left out.

References tell how fast a stage was commanded before the first row (`moving.py`); voltages do not.
A replay begins at rest, and is as fast as the stage once back-EMF and friction have let it forget
that; until then nothing is compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from corexy_fmi.engine.data.samples import Run, Samples
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fitting.noise import quick_noise
from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

PLACES = ("x", "y", "phi1_meas", "phi2_meas")
FEWEST = 10  # samples that tell a speed
SURE = 8.0  # standard errors from which on it is one
LOOK, STEP, TOLD = 10.0, 1e-3, 0.6  # [s] of a replay at most, and from row to row; share that tells
NEAR = 1e-3  # share of a speed within which another is as fast
MOST = 0.3  # share of a recording that may be left out


def settled_in(runs: Sequence[Run], machine: Machine) -> tuple[list[Run], list[Finding]]:
    """The runs without what they measure before a start at rest is forgotten, where voltages alone
    drive them and they begin in motion; and what to say of those.
    """
    found = [_settled_in(run, machine) for run in runs]
    return [run for run, _ in found], [told for _, told in found if told is not None]


def _settled_in(run: Run, machine: Machine) -> tuple[Run, Finding | None]:
    e = run.excitation
    if e.mode != "voltages" or not any(_moves(run, s) for s in run.samples if s.channel in PLACES):
        return run, None
    text, wait = f"{run.name}: begins in motion, driven by voltages alone", forgotten(machine, e)
    if wait > MOST * float(np.ptp(e.time)):
        fix = "Record from rest, or add the references phi1, phi2; a start at rest is assumed here."
        return run, Finding(text, fix)
    late = [s.without(e.time[s.index] < e.time[0] + wait) for s in run.samples]
    fix = f"Record from rest; its first {1e3 * wait:.0f} ms are not compared here."
    return run.with_samples(tuple(late)), Finding(text, fix)


def _moves(run: Run, samples: Samples) -> bool:
    """Whether a channel moves in its first samples already, by clearly more than its noise."""
    if len(samples.index) < 2 * FEWEST or samples.index[0] >= FEWEST:
        return False
    time, values = run.excitation.time[samples.index][:FEWEST], samples.value[:FEWEST]
    off = time - time.mean()
    spread = float(off @ off)
    return abs(float(off @ values)) > SURE * quick_noise(samples) * math.sqrt(spread)


def forgotten(machine: Machine, e: Excitation) -> float:
    """How long [s] a stage at rest takes until it is as fast as one that is driven all along: by
    the largest voltage of a run, either motor's, along both axes; infinite where it takes longer
    than a replay of ten seconds, or half of the run, can tell.
    """
    time = np.arange(0.0, min(LOOK, 0.5 * float(np.ptp(e.time))), STEP)
    volts = float(max(np.abs(e.input1).max(), np.abs(e.input2).max()))
    return max(_time_to_speed(machine, time, volts, sign * volts) for sign in (1.0, -1.0))


def _time_to_speed(machine: Machine, time: Array, one: float, two: float) -> float:
    names = ("V1", "V2")[: machine.kind.motors]
    channels = {n: np.full(len(time), v) for n, v in zip(names, (one, two), strict=False)}
    response = simulate(machine, Recording("step", time, channels, {}))
    speed = np.hypot(*(response[n] if n in response else 0 * time for n in ("vx", "vy")))
    slower = np.flatnonzero(np.abs(speed - speed[-1]) > NEAR * speed[-1])
    wait = float(time[slower[-1]]) if len(slower) else 0.0
    return wait if wait < TOLD * time[-1] else math.inf
