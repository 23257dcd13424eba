"""How far two fits part on a run that was not made yet, once both have given way to each other as
far as the data that they stand on let them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.planning.foresee import Sensing, onto, placed
from corexy_fmi.kernel.call import Array

ROUNDS = 4  # Gauss-Newton steps
SHARES = (1.0, 0.4, 0.1)  # of a step that are tried
CLOSE = 0.1  # of what is left: what linear models promise below it


@dataclass(frozen=True, eq=False)
class Foretold:
    """What a fit foretells at ``u`` (size,) of an imagined run, whose channels read zero: ``shown``
    (rows,) and its ``slopes`` (rows, size) [noise].  The fit stands at ``start`` (size,), and its
    data hold what belongs to no single run as firmly as ``held`` (shared, shared).
    """

    problem: Problem
    start: Array
    held: Array
    u: Array
    shown: Array
    slopes: Array

    @classmethod
    def by(cls, fit: Fit, run: Run, sensing: Sensing) -> Foretold:
        """Of one fit, which may be compared with any other on the same run."""
        problem = onto(fit, run, sensing)
        start, none = placed(fit, problem), np.zeros(0)
        return cls(problem, start, _held(fit), start, none, none).at(start)

    def at(self, u: Array) -> Foretold:
        """The same with other values (size,), within their bounds."""
        u = np.clip(u, *self.problem.limits())
        residual, slopes = self.problem.linearised(u)
        count = self.problem.runs[0].count
        return replace(self, u=u, shown=residual[:count], slopes=slopes[:count])


@dataclass(frozen=True, eq=False)
class Parted:
    """Two fits on one run, which may be repeated: what either shows, where both have come to."""

    teller: Foretold
    rival: Foretold

    @cached_property
    def free(self) -> int:
        """How many values of the teller may give way: none of what its run begins with."""
        return len(self.teller.held)

    @cached_property
    def away(self) -> Array:
        """How far (size,) the rival, then the teller, have left their data."""
        teller, rival = self.teller, self.rival
        return np.concatenate([rival.u - rival.start, (teller.u - teller.start)[: self.free]])

    @cached_property
    def beyond(self) -> Array:
        """What the one shows beyond the other (rows,) [noise]."""
        return self.rival.shown - self.teller.shown

    @cached_property
    def squares(self) -> tuple[Array, Array]:
        """Slopes of ``beyond``: M' beyond (size,) and M' M (size, size)."""
        slopes = np.hstack([self.rival.slopes, -self.teller.slopes[:, : self.free]])
        return slopes.T @ self.beyond, slopes.T @ slopes

    def ties(self, times: int) -> Array:
        """What so many repeats are held by (size, size): data, and what each begins with."""
        shared, own = len(self.rival.held), len(self.rival.u)
        ties = np.zeros((len(self.away), len(self.away)))
        ties[:shared, :shared], ties[own:, own:] = self.rival.held, self.teller.held
        begins = np.arange(shared, own)
        ties[begins, begins] = times
        return ties

    def here(self, times: int) -> float:
        """The squared distance of so many repeats where both stand [noise squared]."""
        away = self.away
        return float(times * self.beyond @ self.beyond + away @ self.ties(times) @ away)

    def distance(self, times: int) -> float:
        """The least, by linear models of both."""
        pull, step = self._step(times)
        return max(self.here(times) + float(pull @ step), 0.0)

    def _step(self, times: int) -> tuple[Array, Array]:
        """Half the slope of `here`, and the step to its least."""
        ties, (pull, normal) = self.ties(times), self.squares
        pull = times * pull + ties @ self.away
        return pull, np.asarray(-np.linalg.lstsq(times * normal + ties, pull, rcond=1e-12)[0])

    def moved(self, step: Array) -> Parted:
        """Both at other values."""
        own, teller = len(self.rival.u), self.teller.u.copy()
        teller[: self.free] += step[own:]
        return Parted(self.teller.at(teller), self.rival.at(self.rival.u + step[:own]))

    def given_way(self, times: int) -> Parted:
        """Where both come to on so many repeats: a stage that rings is no linear function of its
        stiffness, and linear models of it promise what no run keeps.
        """
        best = self
        for _ in range(ROUNDS):
            step = best._step(times)[1]
            tried = (best.moved(share * step) for share in SHARES)
            nearer = next((t for t in tried if t.here(times) < best.here(times)), None)
            if nearer is None:
                break
            best = nearer
            if best.distance(times) > (1 - CLOSE) * best.here(times):
                break
        return best


def _held(fit: Fit) -> Array:
    """How firmly a fit's data hold what belongs to no single run: inverse of its covariance."""
    shared = len(fit.problem.unknowns)
    known = fit.jacobian.T @ fit.jacobian
    inner, cross, rest = known[:shared, :shared], known[:shared, shared:], known[shared:, shared:]
    return np.asarray(inner - cross @ np.linalg.pinv(rest) @ cross.T)
