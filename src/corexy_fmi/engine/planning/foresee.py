"""What a motion that was not run yet would show: a synthetic run, and a fit's problem on it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.engine.data.samples import Run, make_run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording


@dataclass(frozen=True)
class Sensing:
    """What would be measured: the noise of each channel, and how often it is taken [s], 0 for every
    row.
    """

    noise: dict[str, Noise]
    spacing: dict[str, float] = field(default_factory=dict)

    @classmethod
    def like(cls, fit: Fit) -> Sensing:
        """As in the runs that a fit stands on; a channel's first run counts."""
        found, spacing = dict[str, Noise](), dict[str, float]()
        for run, models in zip(fit.problem.runs, fit.problem.noise, strict=True):
            for samples, noise in zip(run.samples, models, strict=True):
                if samples.channel not in found and len(samples.index) > 1:
                    found[samples.channel] = noise
                    spacing[samples.channel] = run.spacing(samples)
        return cls(found, spacing)

    def taken(self, channel: str, time: Array) -> NDArray[np.intp]:
        """Rows, of those at times (rows,) [s], at which a channel is taken."""
        every = self.spacing.get(channel, 0.0)
        if every <= 0:
            return np.arange(len(time))
        wanted = np.arange(time[0], time[-1] + every / 2, every)
        return np.unique(np.rint(np.interp(wanted, time, np.arange(len(time)))).astype(np.intp))


def imagined(order: Recording, machine: Machine, sensing: Sensing) -> Run:
    """A run of an order (phi1, phi2) in which every channel reads zero whenever it is taken."""
    channels = dict(order.channels)
    for channel in sensing.noise:
        channels[channel] = np.full(len(order.time), np.nan)
        channels[channel][sensing.taken(channel, order.time)] = 0.0
    about = dict(order.metadata)
    if machine.drive == "dc" and machine.controller is not None:
        about["controller"] = machine.controller.line
    return make_run(Recording(order.name, order.time, channels, about), machine, "train")


def onto(fit: Fit, run: Run, sensing: Sensing) -> Problem:
    """A fit's problem with one imagined run in place of its own.

    By the micro-step that it needs: a longer one, whose errors its own runs hid, would part it on
    quicker motions from a rival that took another.
    """
    noise = tuple(sensing.noise[s.channel] for s in run.samples)
    return replace(fit.problem, runs=(run,), noise=(noise,), coarse=1.0)


def placed(fit: Fit, problem: Problem) -> Array:
    """A fit's internal vector (size,) in a problem of one other run, which begins relaxed."""
    u = np.zeros(problem.size)
    u[: len(problem.unknowns)] = fit.u[: len(problem.unknowns)]
    return u


def filled(run: Run, values: Array) -> Run:
    """The run with outputs (channels, rows) in place of its zeros."""
    pairs = zip(run.samples, values, strict=True)
    return run.with_samples(tuple(replace(s, value=v[s.index]) for s, v in pairs))
