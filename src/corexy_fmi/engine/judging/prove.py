"""Prove: the same rms in all three states of the machine, on data used and on data kept back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from corexy_fmi.engine.data.samples import LONG, Run, judged
from corexy_fmi.engine.fitting.clock import start
from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.judging.predict import Foretold, foretell
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine

STATES = ("nominal", "retuned", "explained")


@dataclass(frozen=True, eq=False)
class Replay:
    """A machine replayed on one run, offsets and initial deflection fitted.

    ``errors`` measured minus simulated for each channel, mean removed; ``cost`` [nats] of the
    whitened errors.
    """

    run: Run
    errors: tuple[Array, ...]
    fit: Fit

    def rms(self, channel: int) -> float:
        """Root mean square error of a channel."""
        return float(np.sqrt(np.mean(self.errors[channel] ** 2)))

    @property
    def cost(self) -> float:
        """Half the sum of squared whitened errors [nats]."""
        return 0.5 * float(self.fit.residual @ self.fit.residual)


def replay(layout: Layout, machine: Machine, run: Run, noise: tuple[Noise, ...]) -> Replay:
    """Replay a machine as it is; only the nuisances are free.

    A long run goes with none but its offsets: how it began does not matter to it.
    """
    problem = Problem(layout, machine, (run,), pinned=True, noise=(noise,))
    rounds = 0 if len(run.excitation.time) > LONG else 6
    fit = minimise(problem, start(problem), rounds)
    found = [e[0] for e in problem.errors(fit.u[None], 0)]
    errors = [e - o for e, o in zip(found, _offsets(run, found), strict=True)]
    return Replay(run, tuple(errors), fit)


def _offsets(run: Run, errors: list[Array]) -> list[float]:
    """The constant offset of each channel, 0 of a zeroed one."""
    pairs = zip(run.samples, errors, strict=True)
    return [0.0 if s.channel in run.zeroed else float(e.mean()) for s, e in pairs]


def follow_up(
    layout: Layout, machine: Machine, run: Run, noise: tuple[Noise, ...], before: Run
) -> Replay:
    """Replay the last part of a recording with the nuisances of its first part ``before``.

    An offset fitted to the last part alone would hide what happened between the two.
    """
    first = replay(layout, machine, before, noise).fit
    problem = replace(first.problem, runs=(run,))
    offsets = _offsets(before, [e[0] for e in first.problem.errors(first.u[None], 0)])
    errors = [e[0] - o for e, o in zip(problem.errors(first.u[None], 0), offsets, strict=True)]
    parts = [
        n.whiten(e[None], s.breaks)[0] for e, s, n in zip(errors, run.samples, noise, strict=True)
    ]
    residual = np.concatenate([*parts, np.zeros(problem.size)])
    fit = Fit(problem, first.u, 0.5 * float(residual @ residual), residual)
    return Replay(run, tuple(errors), fit)


def channel_noise(
    train: tuple[Run, ...], noise: tuple[tuple[Noise, ...], ...], run: Run
) -> tuple[Noise, ...]:
    """For each channel of a run, the noise that training showed: on the same recording, else on
    the first one that measured it.
    """
    known: dict[str, Noise] = {}
    order = sorted(range(len(train)), key=lambda k: train[k].name != run.name)
    for k in order:
        for samples, model in zip(train[k].samples, noise[k], strict=True):
            known.setdefault(samples.channel, model)
    return tuple(known[s.channel] for s in run.samples if s.channel in known)


@dataclass(frozen=True, eq=False)
class Proof:
    """Replays of the three machines on every run, in the order of the runs.

    ``foretold`` holds what fits foretell, by state and run, where they could; ``silent`` tells in
    words how much of the data kept back was not asked.
    """

    runs: tuple[Run, ...]
    replays: dict[str, tuple[Replay, ...]]
    noise_std: tuple[tuple[float, ...], ...]
    foretold: Mapping[tuple[str, int], Foretold] = field(default_factory=dict)
    silent: str = ""

    def pooled(self, state: str, role: str) -> float:
        """Rms over all position samples of a role, each channel relative to its noise."""
        parts = [
            e / s
            for r, replayed in enumerate(self.replays[state])
            if self.runs[r].role == role
            for e, s in zip(replayed.errors, self.noise_std[r], strict=True)
        ]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else float("nan")

    def gains(self, role: str) -> list[float]:
        """Gain [nats] of explained over retuned, for each run of a role: where it was foretold, of
        the predictive likelihood, else with all parameters held.
        """
        chosen = [r for r, run in enumerate(self.runs) if run.role == role]
        return [self._cost("retuned", r) - self._cost("explained", r) for r in chosen]

    def contrasts(self, role: str) -> list[float]:
        """What retuned and explained machine differ by [nats] on each run of a role: half the
        squared distance of their replays.  The gain of the right one scatters around it.
        """
        chosen = [r for r, run in enumerate(self.runs) if run.role == role]
        return [self._contrast(r) for r in chosen]

    def _contrast(self, run: int) -> float:
        pair = (self.replays[state][run].fit.residual for state in ("retuned", "explained"))
        one, other = (residual[: self.runs[run].count] for residual in pair)
        return 0.5 * float(np.sum((one - other) ** 2))

    def _cost(self, state: str, run: int) -> float:
        told = self.foretold.get((state, run))
        return told.cost if told else self.replays[state][run].cost

    def within_training(self, state: str, role: str) -> float:
        """Rms of whitened errors over a role's recordings, with parameters where each wants them,
        as far as training lets them move; NaN where one of them was not foretold.
        """
        chosen = [r for r, run in enumerate(self.runs) if run.role == role]
        if not chosen or any((state, r) not in self.foretold for r in chosen):
            return float("nan")
        left = [self.foretold[state, r].left for r in chosen]
        return float(np.sqrt(np.average(left, weights=[self.runs[r].count for r in chosen])))


def prove(
    layout: Layout,
    machines: dict[str, Machine],
    runs: tuple[Run, ...],
    train: tuple[Run, ...],
    noise: tuple[tuple[Noise, ...], ...],
    own: Mapping[tuple[str, str, str], Machine] | None = None,
    before: Mapping[str, Run] | None = None,
    fits: Mapping[str, Fit] | None = None,
) -> Proof:
    """Replay nominal, retuned and explained machine on every run.

    ``own`` holds the machines of single runs by state, role and name of the run; ``before`` the
    first part of a recording whose last part is held out, by name; ``fits`` those that foretell
    held-out runs, by state.
    """

    def one(state: str, run: Run, n: tuple[Noise, ...]) -> Replay:
        machine = (own or {}).get((state, run.role, run.name), machines[state])
        if run.role == "holdout" and before and run.name in before:
            return follow_up(layout, machine, run, n, judged(before[run.name], [run]))
        return replay(layout, machine, run, n)

    runs = tuple(judged(run, train) for run in runs)
    models = [channel_noise(train, noise, run) for run in runs]
    replays = {
        state: tuple(one(state, run, n) for run, n in zip(runs, models, strict=True))
        for state in machines
    }
    std = tuple(tuple(n.marginal for n in model) for model in models)
    foretold = {
        (state, r): foretell(fit, run, models[r], replays[state][r].fit)
        for state, fit in (fits or {}).items()
        for r, run in enumerate(runs)
        if run.role == "holdout"
        and run.name not in (before or {})
        and len(run.excitation.time) <= LONG
    }
    return Proof(runs, replays, std, foretold)
