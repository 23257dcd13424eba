"""Derivatives of a residual: one-sided differences, run as lanes beside the point itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from corexy_fmi.engine.fitting.scaling import agree, along
from corexy_fmi.engine.fitting.unknowns import SMOOTHING
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.spare import shared

if TYPE_CHECKING:
    from corexy_fmi.engine.fitting.problem import Problem

# Finite differences on the internal scale.  Where friction catches and lets go, the residual bends
# within thousandths: longer ones told what the data do not, and held fits where they were.
STEP = 1e-4  # of nominal parameters and whatever is logarithmic
BROKEN = 1e60  # derivative or error [SI] from which on a run broke down
WAVE_STEP = 1e-4  # the same of a count or frequency of waves
SHARP_STEP = 2e-4  # the same of what moves the edges of pulses
EFFECT_STEP, LAW_STEP, OWN_STEP = 1e-3, 2e-3, 2e-3  # of effects, free-form laws, a run's own
LONGEST_STEP = 0.6  # of any, stretched
SMOOTHING_STEP = 0.02  # where sgn begins to be rounded there is no derivative


def linearised(
    problem: Problem, u: Array, borrowed: Array | None = None, stretch: float = 1.0
) -> tuple[Array, Array]:
    """Residual (samples + size,) at u (size,) and its derivative (samples + size, size).

    One-sided differences, run as lanes beside u itself, ``stretch`` times their usual length.
    Where ``borrowed`` is given, only its columns that are NaN are computed.  A column whose run
    broke down is zero.
    """
    samples = problem.parts[-1].stop
    wanted = np.ones(problem.size, dtype=bool) if borrowed is None else np.isnan(borrowed[0])
    slopes = np.zeros((samples + problem.size, problem.size), order="F")
    slopes[samples:] = problem.root
    if borrowed is not None:
        slopes[:, ~wanted] = borrowed[:, ~wanted]
    residual = np.concatenate([np.zeros(samples), problem.root @ (u - problem.prior[0])])
    steps = step_lengths(problem, u, stretch)
    move = along(problem.unknowns, u, problem.limits(), STEP * stretch)

    def of_run(r: int) -> None:
        here, columns = problem.parts[r], problem.moving(r)
        columns = columns[wanted[columns]]
        sets = np.repeat(u[None], len(columns) + 2, axis=0)
        sets[1 + np.arange(len(columns)), columns] += steps[columns]
        sets[-1] += move
        base, moved, change = residual[here], slopes.T[:, here], np.empty(problem.runs[r].count)
        problem.whitened(problem.lanes(sets, r), r, [base, *(moved[k] for k in columns), change])
        with np.errstate(over="ignore", invalid="ignore"):  # runs that broke down
            for k in columns:
                moved[k] -= base
                moved[k] /= steps[k]
            agree(moved, move, change - base)

    shared(of_run, range(len(problem.runs)))
    for column in slopes.T[:, :samples]:
        if not max(column.max(initial=0.0), -column.min(initial=0.0)) < BROKEN:
            column[:] = 0.0
    return residual, slopes


def step_lengths(problem: Problem, u: Array, stretch: float = 1.0) -> Array:
    """Step of each difference, turned inwards at an upper bound; a long one ends there."""
    steps = np.full(problem.size, STEP)
    longest = max(float(np.ptp(run.excitation.time)) for run in problem.runs)
    steps[len(problem.unknowns) :] = OWN_STEP
    for k, unknown in enumerate(problem.unknowns):
        if "free_form" in unknown.key:
            steps[k] = LAW_STEP
        elif unknown.key == SMOOTHING:
            steps[k] = SMOOTHING_STEP
        elif "." in unknown.key and not unknown.log:
            steps[k] = SHARP_STEP if problem.hypothesis.shaped else EFFECT_STEP
    steps = np.minimum(stretch * steps, LONGEST_STEP)
    for k, unknown in enumerate(problem.unknowns):
        if unknown.wave:
            turns = float(unknown.value(u[k])) * max(longest, 1.0)
            steps[k] = min(WAVE_STEP, 0.02 / turns)
    low, high = problem.limits()
    beyond, down = u + steps > high, u - low >= high - u
    inwards = np.where(down, np.maximum(-steps, low - u), high - u)
    return np.where(beyond & (inwards != 0), inwards, steps)
