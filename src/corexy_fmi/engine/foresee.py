"""What a motion that was not run yet would show: a synthetic run, and a fit's problem on it."""

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
