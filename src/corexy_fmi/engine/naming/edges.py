"""When a force came and went: its jumps along an axis, by generalised likelihood ratio.

The whitened residual is compared, at every time, with what a force that jumps there would leave in
it (Willsky, Jones, IEEE Trans. Automatic Control 21(1), 1976, doi:10.1109/TAC.1976.1101146).  The
response to a jump is read off the model itself, at several times of the run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape, law_offset, write_law
from corexy_fmi.engine.fitting.noise import estimate
from corexy_fmi.kernel.call import LANES, Array, run_lanes
from corexy_fmi.kernel.layout import FIRST_VALUE, Layout

LASTS, RISE = 0.15, 1e-6  # [s] of a response that is compared; over which the force jumps
LEAD = 16  # samples at rest before a response, more than a noise model looks back
FAR = 8.0  # robust standard deviations of a jump's score that count


@dataclass(frozen=True)
class Edge:
    """A jump of the force along an axis: when [s], and by how much [N]."""

    time: float
    size: float


def edges(fit: Fit, run: int, axis: str) -> list[Edge]:
    """Jumps of the force along an axis that a run's position shows, in order of time."""
    r = fit.problem.runs[run]
    place = next((c for c, s in enumerate(r.samples) if s.channel == axis), None)
    taken = any(law.location == axis for law in fit.problem.machine.free_forms)
    if place is None or taken:
        return []
    samples = r.samples[place]
    time = r.excitation.time[samples.index]
    spacing = float(np.median(np.diff(time)))
    errors = fit.problem.errors(fit.u[None], run)[place][0]
    response = step_response(fit, run, axis, spacing)
    if len(errors) < 4 * len(response) or np.ptp(response) == 0:
        return []
    noise = estimate(errors, samples.breaks)
    white = noise.whiten(errors - np.median(errors), samples.breaks)
    still = np.zeros(LEAD)
    unbroken = np.zeros(LEAD + len(response), dtype=bool)
    mark = noise.whiten(np.r_[still, response], unbroken)[LEAD:]
    power = float(mark @ mark)
    sizes = np.correlate(np.r_[white, np.zeros(len(mark) - 1)], mark, mode="valid") / power
    return _peaks(time, sizes)


def step_response(fit: Fit, run: int, axis: str, spacing: float) -> Array:
    """What a force of 1 N from time zero on moves [m] along its axis, sampled from zero on."""
    problem, e = fit.problem, fit.problem.runs[run].excitation
    begins = np.quantile(e.time[:-1], np.linspace(0.1, 0.9, LANES - 1))
    push = problem.push(fit.u[None], run)
    size = max(problem.machine.at("carriage_coulomb_friction"), 0.05)
    vectors = np.repeat(problem.vectors(fit.u[None], run), LANES, axis=0)
    for vector, begin in zip(vectors[1:], begins, strict=True):
        law = LawShape(axis, "t", (float(begin), float(begin) + RISE), size)
        write_law(problem.layout, vector, law)
        _write_values(problem.layout, vector, law, (0.0, size))
    out = run_lanes(
        problem.layout,
        e,
        vectors,
        fidelity=problem.machine.stage,
        dc=problem.machine.drive == "dc",
        rest=np.repeat(problem.rest(fit.u[None], run), LANES, axis=0),
        push=None if push is None else np.repeat(push, LANES, axis=0),
        channels=(axis,),
        limit=problem.limit,
    )[:, 0]
    after = np.arange(0.0, LASTS, spacing)
    moved = np.array(
        [np.interp(t + after, e.time, row - out[0]) for t, row in zip(begins, out[1:], strict=True)]
    )
    strongest = np.argsort(-np.abs(moved[:, -1]))[: LANES // 2]  # where it does not stick
    return np.asarray(np.median(moved[strongest], axis=0) / size)


def _write_values(layout: Layout, vector: Array, law: LawShape, values: tuple[float, ...]) -> None:
    first = law_offset(layout, law) + FIRST_VALUE
    vector[first : first + len(values)] = values


def _peaks(time: Array, sizes: Array) -> list[Edge]:
    """Extremes that stand far out, each the largest within the length of a response."""
    spread = float(np.median(np.abs(sizes - np.median(sizes)))) / 0.6745
    reach = int(LASTS / 2 / float(np.median(np.diff(time))))
    found, left = [], np.abs(sizes).copy()
    while spread > 0:
        k = int(np.argmax(left))
        if left[k] < FAR * spread:
            break
        found.append(Edge(float(time[k]), float(sizes[k])))
        left[max(k - reach, 0) : k + reach] = 0.0
    return sorted(found, key=lambda edge: edge.time)
