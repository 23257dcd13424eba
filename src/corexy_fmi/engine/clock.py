"""A sensor's clock that nobody tied to the inputs' (`clock: free`): where its fit begins."""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.problem import LATE, LATEST, Problem, late
from corexy_fmi.kernel.call import Array

GRID = 2e-3  # [s]


def start(problem: Problem) -> Array:
    """The machine file's internal vector (size,), each free clock at its best offset on a grid."""
    u = np.zeros(problem.size)
    for r, run in enumerate(problem.runs):
        if run.clock_free:
            u[problem.first_own(r) + problem.own_keys.index("clock")] = _offset(problem, r) / LATE
    return u


def _offset(problem: Problem, run: int) -> float:
    """Delay [s] of a run's samples at which the simulated run fits them best."""
    r, out = problem.runs[run], problem.simulate(np.zeros((1, problem.size)), run)
    delays = np.arange(-LATEST, LATEST + GRID / 2, GRID)
    costs = np.zeros(len(delays))
    for n, delay in enumerate(delays):
        shifted = late(r.excitation.time, out, np.array([delay]))[0]
        for c, samples in enumerate(r.samples):
            costs[n] += np.var(samples.value - shifted[c, samples.index]) / np.var(samples.value)
    return float(delays[np.argmin(costs)])
