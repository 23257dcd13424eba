"""The nominal machine, fitted as hard as any hypothesis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine import clock
from corexy_fmi.engine.clean import without_spikes
from corexy_fmi.engine.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.noise import quick_noise, white
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.restart import begun, best
from corexy_fmi.engine.rough import unstuck
from corexy_fmi.engine.samples import Run
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine

HIDDEN = 0.5  # [nats] that a longer micro-step may change


def retune(layout: Layout, machine: Machine, runs: tuple[Run, ...], mapper: Mapper = map) -> Fit:
    """The nominal parameters refitted, spikes left out, under the noise of their own residuals."""
    noise = tuple(tuple(white(quick_noise(s)) for s in run.samples) for run in runs)
    problem = Problem(layout, machine, runs, noise)
    first = minimise(problem, best(begun(problem, clock.start(problem), mapper=mapper)).u, 15)
    cleaned = replace(problem, runs=without_spikes(first))
    return settle(unstuck(minimise(_quick(cleaned, first.u), first.u)))


def _quick(problem: Problem, u: np.ndarray) -> Problem:
    """The problem with micro-steps of twice the length, where the samples' noise hides that."""
    coarse = replace(problem, coarse=2.0)
    change = coarse.residual(u[None]) - problem.residual(u[None])
    return coarse if 0.5 * float(np.sum(change**2)) < HIDDEN else problem
