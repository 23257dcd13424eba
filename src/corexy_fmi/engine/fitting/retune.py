"""The nominal machine, fitted as hard as any hypothesis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting import clock
from corexy_fmi.engine.fitting.clean import without_spikes
from corexy_fmi.engine.fitting.fit import HIDDEN, Fit, Mapper, costs, hides, minimise, settle
from corexy_fmi.engine.fitting.micro_step import AT_EASE
from corexy_fmi.engine.fitting.noise import quick_noise, white
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.restart import begun, best
from corexy_fmi.engine.fitting.rough import PAYS, across, unstuck
from corexy_fmi.engine.fitting.slopes import BROKEN
from corexy_fmi.engine.fitting.starts import stiffened
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine

SHOWN = 3.0  # [nats] that longer micro-steps may change; the last fits take the machine's own
AHEAD = 4  # of the fits that were begun, best first, which are carried on
LENGTHS = (4.0, 3.0, AT_EASE)  # of the micro-step, in those that the machine needs


def retune(layout: Layout, machine: Machine, runs: tuple[Run, ...], mapper: Mapper = map) -> Fit:
    """The nominal parameters refitted, spikes left out, under the noise of their own residuals."""
    noise = tuple(tuple(white(quick_noise(s)) for s in run.samples) for run in runs)
    problem = Problem(layout, machine, runs, noise=noise)
    ahead = sorted(begun(problem, clock.start(problem), mapper=mapper), key=lambda fit: fit.cost)
    ends = _distinct(list(mapper(lambda fit: minimise(problem, fit.u, 15), ahead[:AHEAD])))
    cleaned = replace(problem, runs=without_spikes(ends[0]))
    return best(list(mapper(lambda fit: _ended(cleaned, fit.u), ends)))


def _distinct(fits: list[Fit]) -> list[Fit]:
    """The fits of different ends, best first: each may be led elsewhere by the noise's colour."""
    ordered = sorted(fits, key=lambda fit: fit.cost)
    apart = np.diff([fit.cost for fit in ordered], prepend=-np.inf) > HIDDEN
    return [fit for fit, new in zip(ordered, apart, strict=True) if new]


def _ended(problem: Problem, u: np.ndarray) -> Fit:
    """The problem's fit from u, carried to its end."""
    return _carried(settle(unstuck(minimise(_quick(problem, u), u))))


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
    return Fit(problem, fit.u, cost, residual)


def _quick(problem: Problem, u: np.ndarray) -> Problem:
    """The problem with the longest micro-steps that change next to nothing, nor break down.

    More than twice the length only where belts may still stiffen as far as a search begins.
    """
    for times in LENGTHS:
        coarse = replace(problem, coarse=times)
        begins = [np.zeros_like(u)] if times <= AT_EASE else _stiff(coarse, u)
        if hides(problem, coarse, u, SHOWN) and _holds(coarse, begins):
            return coarse
    return problem


def _stiff(problem: Problem, u: np.ndarray) -> list[np.ndarray]:
    """The fit and the machine file with stiffer belts: where what lags is missing, retuned belts
    are too soft, and its fit must find back.
    """
    stiff = [stiffened(problem, start) for start in (u, np.zeros_like(u))]
    return [row for row in stiff if row is not None]


def _holds(problem: Problem, sets: list[np.ndarray]) -> bool:
    """Whether no run of the sets breaks down."""
    return not sets or bool(costs(problem.residual(np.array(sets))).max() < BROKEN)
