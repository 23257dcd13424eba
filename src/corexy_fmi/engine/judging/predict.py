"""What a fit foretells of a run that it has not seen, its parameters being as sure as they are.

A right model whose parameters training left vague misses other motions by more than noise, and a
wrong one with vaguer parameters would still be told by it.  So held-out runs are judged by their
predictive likelihood: parameters may move as far as training lets them, and what the fit would then
gain is paid for by the volume that it gains it in (Laplace's approximation; MacKay 2003,
Information Theory, Inference, and Learning Algorithms, chapter 27).

What belongs to one recording, as the phase of a fan, is found anew on each, from all over its
range, and is not paid for.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.fit import Fit, costs, minimise
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.rough import softened, unstuck
from corexy_fmi.engine.naming.own_times import SHIFTS
from corexy_fmi.engine.naming.spread import TIMES
from corexy_fmi.kernel.call import Array

LEAST = 1e-9  # precision of what nothing is known of
ROUNDS = 6  # iterations from the fit, more where the ground is rough
PHASES = 8  # of a wave, from which its phase in one recording begins
TOGETHER = 32  # starts in memory at once


@dataclass(frozen=True)
class Foretold:
    """What a fit foretold of a run: minus the log of its predictive likelihood ``cost`` [nats], up
    to what all fits share, and the mean square ``left`` of its whitened errors with the parameters
    where it wants them, as far as training lets them move.
    """

    cost: float
    left: float


def foretell(fit: Fit, run: Run, noise: tuple[Noise, ...], own: Fit | None = None) -> Foretold:
    """How well a fit foretells a run.

    ``own`` is the fit of the run's own nuisances with the parameters of ``fit`` held.
    """
    cost, there = _foretold(fit, run, noise, own)
    return Foretold(cost, float(np.mean(there.residual[: run.count] ** 2)))


def carried(fit: Fit, run: Run, noise: tuple[Noise, ...]) -> Fit:
    """The fit's parameters on another run, with what belongs to that alone as found there."""
    problem = replace(fit.problem, runs=(run,), noise=(noise,))
    known = dict(zip(fit.problem.keys, fit.u, strict=True))
    there = zip(problem.keys, _foretold(fit, run, noise)[1].u, strict=True)
    u = np.array([known.get(key, value) for key, value in there])
    residual = problem.residual(u[None])[0]
    return Fit(problem, u, float(costs(residual[None])[0]), residual)


def _foretold(
    fit: Fit, run: Run, noise: tuple[Noise, ...], own: Fit | None = None
) -> tuple[float, Fit]:
    problem = replace(fit.problem, runs=(run,), noise=(noise,))
    known = dict(zip(fit.problem.keys, fit.u, strict=True))
    known |= dict(zip(own.problem.keys, own.u, strict=True)) if own else {}
    u = np.array([known.get(key, 0.0) for key in problem.keys])
    return _laplace(problem, _begun(problem, u), _precision(fit, problem))


def _begun(problem: Problem, u: Array) -> Array:
    """u (size,) with what belongs to this run alone where it costs least, all over its range."""
    own = {k: x.key for k, x in enumerate(problem.unknowns) if x.run is not None}
    if not own:
        return u
    parameters = {
        f"{i.effect.name}.{i.location}.{p.name}": p
        for i in problem.hypothesis.uses
        for p in i.effect.parameters
    }
    time = problem.runs[0].excitation.time
    known = [parameters.get(key.partition("@")[0]) for key in own.values()]
    offered = [_values(p, time) if p else _onsets(time) for p in known]
    starts = np.repeat(u[None], int(np.prod([len(v) for v in offered])), axis=0)
    for start, values in zip(starts, itertools.product(*offered), strict=True):
        start[list(own)] = [
            problem.unknowns[k].internal(v) for k, v in zip(own, values, strict=True)
        ]
    parts = np.split(starts, range(TOGETHER, len(starts), TOGETHER))
    tried = np.concatenate([costs(problem.residual(part)) for part in parts])
    return np.asarray(starts[int(np.argmin(tried))])


def _onsets(time: Array) -> list[float]:
    """Where the time of a free-form law may begin in a recording."""
    return [share * float(np.ptp(time)) for share in (0.0, *SHIFTS)]


def _values(parameter: Parameter, time: Array) -> list[float]:
    """Where a parameter of one recording may begin."""
    if parameter.periodic:
        return [parameter.periodic * k / PHASES for k in range(PHASES)]
    if parameter.over == "time":
        return np.linspace(time[0], time[-1], TIMES + 2)[1:-1].tolist()
    either = (1.0, -1.0) if parameter.size and parameter.lower < parameter.neutral else (1.0,)
    return [parameter.neutral, *(sign * start for start in parameter.starts for sign in either)]


@dataclass(frozen=True, eq=False)
class _Posterior:
    """A problem whose prior is what training left: normal about ``begin`` (size,), and ``root``
    (size, size) of its precision.
    """

    problem: Problem
    begin: Array
    root: Array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.problem.size

    @property
    def runs(self) -> tuple[Run, ...]:
        """The recordings."""
        return self.problem.runs

    @property
    def parts(self) -> list[slice]:
        """Where the samples of each recording stand."""
        return self.problem.parts

    def moving(self, run: int) -> Array:
        """Indices of the unknowns that move a run."""
        return self.problem.moving(run)

    def limits(self) -> tuple[Array, Array]:
        """Bounds (size,) of the unknowns."""
        return self.problem.limits()

    def residual(self, sets: Array) -> Array:
        """Whitened residuals with this prior's (sets, samples + size)."""
        found = self.problem.residual(sets)
        found[:, -self.size :] = (sets - self.begin) @ self.root.T
        return found

    def linearised(
        self, u: Array, borrowed: Array | None = None, stretch: float = 1.0
    ) -> tuple[Array, Array]:
        """Residual with this prior's, and its derivative."""
        residual, slopes = self.problem.linearised(u, borrowed, stretch)
        residual[-self.size :] = self.root @ (u - self.begin)
        slopes[-self.size :] = self.root
        return residual, slopes

    def scale_unseen(self, u: Array, jacobian: Array) -> bool:
        """Training has told the common factor as well as it can."""
        return False

    def log_scale(self) -> float:
        """What all fits share."""
        return 0.0


def _precision(fit: Fit, problem: Problem) -> Array:
    """What training says of each shared unknown, and the prior of each of the run's own.

    An effect's parameter that training says nothing of is as unsure as its bounds are wide.
    """
    low, high = problem.limits()
    shared = np.array([k for k, x in enumerate(problem.unknowns) if x.run is None], dtype=int)
    here = np.array([fit.problem.keys.index(problem.keys[k]) for k in shared], dtype=int)
    others = np.setdiff1d(np.arange(fit.problem.size), here)
    normal = fit.jacobian.T @ fit.jacobian
    rest = normal[np.ix_(others, others)] + LEAST * np.eye(len(others))
    across = normal[np.ix_(here, others)]
    learnt = normal[np.ix_(here, here)] - across @ np.linalg.solve(rest, across.T)
    size, axes = np.linalg.eigh(0.5 * (learnt + learnt.T))
    found = np.diag(np.maximum(problem.prior[1] ** 2, LEAST))
    wide = np.diag(12.0 / np.maximum(high - low, 1e-3)[shared] ** 2)  # of an even spread
    found[np.ix_(shared, shared)] = (axes * np.maximum(size, LEAST)) @ axes.T + wide
    return np.asarray(found)


def _laplace(problem: Problem, begin: Array, precision: Array) -> tuple[float, Fit]:
    """Cost at the best parameters near, and half the log of how much the volume of those that
    training knows shrinks; with the fit there.
    """
    centre = begin.copy()
    centre[len(problem.unknowns) :] = 0.0
    power, axes = np.linalg.eigh(precision)
    root = np.sqrt(np.maximum(power, LEAST))[:, None] * axes.T
    posterior = _Posterior(problem, centre, np.asarray(root))
    fit = softened(unstuck(minimise(cast(Problem, posterior), begin, ROUNDS)))
    if not np.isfinite(fit.cost):
        return float("inf"), fit
    normal = fit.jacobian.T @ fit.jacobian
    own = np.zeros(problem.size, dtype=bool)
    own[: len(problem.unknowns)] = [x.run is not None for x in problem.unknowns]
    shrunk = _volume(normal) - _volume(normal[np.ix_(own, own)])
    return fit.cost + 0.5 * (shrunk - _volume(precision[np.ix_(~own, ~own)])), fit


def _volume(matrix: Array) -> float:
    """Log of the determinant; 0 of nothing."""
    return float(np.linalg.slogdet(matrix)[1]) if len(matrix) else 0.0
