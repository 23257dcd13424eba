"""Where the fit of what a recording leaves unknown begins: the offset of a sensor's clock that
nobody tied to the inputs' (`clock: free`), and how a stage swings that its inputs let rest.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.parametrisation import LATE, LATEST
from corexy_fmi.engine.fitting.problem import Problem, late
from corexy_fmi.kernel.call import PUSH, Array

GRID = 2e-3  # [s]
OFF = 0.3  # of the scale of a push


def start(problem: Problem) -> Array:
    """The machine file's internal vector (size,), each free clock at its best offset on a grid;
    where a run begins in motion, but at rest by its inputs, off that: a stage that sticks shows no
    slope.
    """
    u = np.zeros(problem.size)
    for r, run in enumerate(problem.runs):
        if run.clock_free:
            u[problem.first_own(r) + problem.own_keys.index("clock")] = _offset(problem, r) / LATE
        if run.moving and not moves_at_first(run):
            first = problem.first_own(r)
            u[[first + k for k, key in enumerate(problem.own_keys) if key in PUSH]] = OFF
    return u


def moves_at_first(run: Run) -> bool:
    """Whether the inputs of a run move over its first interval."""
    e = run.excitation
    return bool(e.input1[1] != e.input1[0] or e.input2[1] != e.input2[0])


def _offset(problem: Problem, run: int) -> float:
    """Delay [s] of a run's samples at which the simulated run fits them best."""
    r, out = problem.runs[run], problem.simulate(np.zeros((1, problem.size)), run)
    delays = np.arange(-LATEST, LATEST + GRID / 2, GRID)
    costs = np.zeros(len(delays))
    for n, delay in enumerate(delays):
        shifted = late(r.excitation.time, out, np.array([delay]))[0]
        for c, samples in enumerate(r.samples):
            left = samples.value - shifted[c, samples.index]
            costs[n] += np.var(left) / (np.var(samples.value) or 1.0)  # one that stands still
    return float(delays[np.argmin(costs)])
