"""The nominal machine, fitted as hard as any hypothesis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine import clock
from corexy_fmi.engine.clean import without_spikes
from corexy_fmi.engine.fit import Fit, Mapper, costs, hides, minimise, settle
from corexy_fmi.engine.micro_step import AT_EASE
from corexy_fmi.engine.noise import quick_noise, white
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.restart import begun, best
from corexy_fmi.engine.rough import PAYS, across, unstuck
from corexy_fmi.engine.samples import Run
from corexy_fmi.engine.slopes import BROKEN
from corexy_fmi.engine.starts import stiffened
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine

SHOWN = 3.0  # [nats] that longer micro-steps may change; the last fits take the machine's own
LENGTHS = (4.0, 3.0, AT_EASE)  # of the micro-step, in those that the machine needs


def retune(layout: Layout, machine: Machine, runs: tuple[Run, ...], mapper: Mapper = map) -> Fit:
    """The nominal parameters refitted, spikes left out, under the noise of their own residuals."""
    noise = tuple(tuple(white(quick_noise(s)) for s in run.samples) for run in runs)
    problem = Problem(layout, machine, runs, noise)
    first = minimise(problem, best(begun(problem, clock.start(problem), mapper=mapper)).u, 15)
    cleaned = replace(problem, runs=without_spikes(first))
    return _carried(settle(unstuck(minimise(_quick(cleaned, first.u), first.u))))


def _carried(fit: Fit) -> Fit:
    """The fit carried on across bends under its own noise, where that pays."""
    on = across(fit)
    return fit if on.cost > fit.cost - PAYS else best([fit, settle(on)])


def quick(fit: Fit) -> Fit:
    """The fit as it is, where longer micro-steps change next to nothing with those."""
    problem = _quick(replace(fit.problem, coarse=1.0), fit.u)
    if not np.isfinite(fit.cost) or problem.limit <= fit.problem.limit:
        return fit
    residual = problem.residual(fit.u[None])[0]
    cost = 0.5 * float(residual @ residual) + problem.log_scale()
    return Fit(problem, fit.u, cost, residual, fit.near)


def _quick(problem: Problem, u: np.ndarray) -> Problem:
    """The problem with the longest micro-steps that change next to nothing.

    More than twice the length only where belts may still stiffen as far as a search begins.
    """
    for times in LENGTHS:
        coarse = replace(problem, coarse=times)
        if hides(problem, coarse, u, SHOWN) and (times <= AT_EASE or _holds(coarse, u)):
            return coarse
    return problem


def _holds(problem: Problem, u: np.ndarray) -> bool:
    """Whether the runs with stiffer belts do not break down, nor those of the machine file: where
    what lags is missing, retuned belts are too soft, and its fit must find back.
    """
    stiff = [stiffened(problem, start) for start in (u, np.zeros_like(u))]
    sets = np.array([row for row in stiff if row is not None])
    return not len(sets) or bool(costs(problem.residual(sets)).max() < BROKEN)
