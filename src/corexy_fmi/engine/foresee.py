"""What a motion that was not run yet would show: a synthetic run, and how far two models part on
it once the one has been retuned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.noise import Noise
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.samples import Run, make_run
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording


@dataclass(frozen=True)
class Sensing:
    """What would be measured: the noise of each channel."""

    noise: dict[str, Noise]

    @classmethod
    def like(cls, fit: Fit) -> Sensing:
        """As in the runs that a fit stands on; a channel's first noise counts."""
        found: dict[str, Noise] = {}
        for run, models in zip(fit.problem.runs, fit.problem.noise, strict=True):
            for samples, noise in zip(run.samples, models, strict=True):
                found.setdefault(samples.channel, noise)
        return cls(found)


def imagined(order: Recording, machine: Machine, sensing: Sensing) -> Run:
    """A run of an order (phi1, phi2) in which every channel reads zero at every row."""
    channels = dict(order.channels) | {c: np.zeros(len(order.time)) for c in sensing.noise}
    about = dict(order.metadata)
    if machine.drive == "dc" and machine.controller is not None:
        about["controller"] = machine.controller.line
    return make_run(Recording(order.name, order.time, channels, about), machine, "train")


def onto(fit: Fit, run: Run, sensing: Sensing) -> Problem:
    """A fit's problem with one imagined run in place of its own."""
    noise = tuple(sensing.noise[s.channel] for s in run.samples)
    return replace(fit.problem, runs=(run,), noise=(noise,))


def placed(fit: Fit, problem: Problem) -> Array:
    """A fit's internal vector (size,) in a problem of one other run, which begins relaxed."""
    u = np.zeros(problem.size)
    u[: len(problem.unknowns)] = fit.u[: len(problem.unknowns)]
    return u


def filled(run: Run, values: Array) -> Run:
    """The run with outputs (channels, rows) in place of its zeros."""
    pairs = zip(run.samples, values, strict=True)
    return run.with_samples(tuple(replace(s, value=v[s.index]) for s, v in pairs))


@dataclass(frozen=True, eq=False)
class Parted:
    """How far two fits part on a run that is repeated: r, what one foretells there beyond the other
    [noise]; M, its slopes by what the data leave open of both; P, how firmly those data hold them,
    and Q, what each repeat begins with.
    """

    power: float  # r' r
    pull: Array  # M' r
    slopes: Array  # M' M
    known: Array  # P
    each: Array  # Q

    def distance(self, times: int) -> float:
        """E_sep of so many repeats: neither fit may leave the data that it stands on."""
        normal = times * (self.slopes + self.each) + self.known
        spare = self.pull @ np.linalg.lstsq(normal, self.pull, rcond=1e-12)[0]
        return max(times * (self.power - times * float(spare)), 0.0)


def parting(teller: Fit, rival: Fit, run: Run, sensing: Sensing) -> Parted:
    """What one fit foretells on a run against the nearest that another can do there."""
    told = onto(teller, run, sensing)
    truth = told.simulate(placed(teller, told)[None], 0)[0]
    shown = filled(run, truth)
    problem, told = onto(rival, shown, sensing), onto(teller, shown, sensing)
    residual, slopes = problem.linearised(placed(rival, problem))
    count, shared, free = problem.runs[0].count, len(problem.unknowns), len(told.unknowns)
    moved = told.linearised(placed(teller, told))[1][:count, :free]
    both = np.hstack([slopes[:count], -moved])
    known, each = np.zeros((2, both.shape[1], both.shape[1]))
    known[:shared, :shared], known[-free:, -free:] = _held(rival), _held(teller)
    own = slice(shared, problem.size)
    each[own, own] = np.eye(problem.size - shared)
    r = residual[:count]
    return Parted(float(r @ r), both.T @ r, both.T @ both, known, each)


def _held(fit: Fit) -> Array:
    """How firmly a fit's data hold what belongs to no single run: inverse of its covariance."""
    shared = len(fit.problem.unknowns)
    known = fit.jacobian.T @ fit.jacobian
    inner, cross, rest = known[:shared, :shared], known[:shared, shared:], known[shared:, shared:]
    return np.asarray(inner - cross @ np.linalg.pinv(rest) @ cross.T)
