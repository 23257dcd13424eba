"""Fits over rough ground: dry friction bends the residual at every reversal of every part.

Differences over thousandths are right about the slope where a fit stands, and may say nothing of
where the ground falls: on the straight way from where such a fit ended to the truth the cost fell
all along, by 320 nats.  Two cures, both of which only ever lower the cost:

- ``across``: steps by differences up to 100 times as long, then shorter ones, again while it pays.
- ``averaged``: the mean residual and its slope by regression over many sets scattered about the
  fit, narrower and narrower (statistical linearisation; Lefebvre, Bruyninckx, De Schutter 2002,
  doi:10.1109/TAC.2002.800742).  Dearer, so only where the ground is rough: where the slope does not
  foretell what one standard deviation changes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import ENOUGH, Fit, costs, minimise, stepped
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.kernel.call import Array

STRETCHES = (100.0, 30.0, 10.0, 3.0, 1.0)  # lengths of the differences, in turn
LOOK, LONG = 2, 30.0  # lengths that are always tried; the one whose slopes tell how wide to look
CYCLES, EACH, PAYS = 8, 6, 2.0  # at most; iterations of each length; [nats] for another cycle
ON = 0.5  # [nats] that an iteration gains, or the next length has its turn
SETS, WIDE, NARROW, SHRINK = 128, 2.0, 0.5, 0.75  # at least; standard deviations, first and last
UPHILL = 10.0  # [nats] that a step may cost at each standard deviation of the scatter
SCATTERS, ROUNDS, LAST = 30, 3, 10  # scatters at most; both cures in turn; iterations at the end
SOFTER = 3  # scatters until a width and its slopes agree
PROBES, BENT = 32, 0.2  # sets that probe; share of the change that the slope may not foretell
HEAVY = 120_000  # samples from which on the sets take too much memory
FAR = 1e3  # times the cost: a run that broke down
WEAKEST = 1e-4  # share of the strongest direction that a scatter takes any other one to have


def across(fit: Fit) -> Fit:
    """The fit carried on by differences across the bends."""
    for _ in range(CYCLES if np.isfinite(fit.cost) else 0):
        before = fit.cost
        for n, stretch in enumerate(STRETCHES):
            if n == LOOK and before - fit.cost < ENOUGH:
                break
            again = minimise(fit.problem, fit.u, EACH, ON, stretch=stretch)
            fit = again if again.cost < fit.cost else fit
        if before - fit.cost < PAYS:
            break
    return fit


def is_rough(fit: Fit) -> bool:
    """Whether the slope where a fit stands misses what one standard deviation changes."""
    residual, jacobian = fit.problem.linearised(fit.u)
    wide = _root(fit.problem.linearised(fit.u, stretch=LONG)[1])
    sets = _scattered(fit.problem, fit.u, wide, PROBES, 0)
    shown = fit.problem.residual(sets)
    whole = _usable(shown, _cost(residual))
    if 2 * whole.sum() < PROBES:
        return True
    change, foretold = shown[whole] - residual, (sets[whole] - fit.u) @ jacobian.T
    missed, told = (np.sum(part**2, axis=1) for part in (change - foretold, foretold))
    return not float(np.median(missed)) < BENT * float(np.median(told))


def averaged(fit: Fit, seed: int = 0) -> Fit:
    """The fit carried on by slopes that are averaged over its surroundings."""
    problem, u, width = fit.problem, fit.u, WIDE
    residual, jacobian = problem.linearised(u, stretch=LONG)
    least, place = _cost(residual), u
    for n in range(SCATTERS):
        root = width * _root(jacobian)
        sets = _scattered(problem, u, root, max(SETS, 3 * problem.size), seed + n)
        shown = problem.residual(sets)
        whole = _usable(shown, least)
        mean = residual
        if whole.sum() > problem.size + 8:
            usable = _those(shown, whole)
            mean = np.full(len(usable), 1 / len(usable)) @ usable
            jacobian = _regressed(problem, sets[whole] - u, usable, jacobian)
        step, after, _ = stepped(problem, u, mean, jacobian, problem.limits())
        best, before = int(np.argmin(costs(shown))), least
        if _cost(shown[best]) < min(_cost(residual), _cost(after)):
            u, residual = sets[best], shown[best]
        elif _cost(after) < _cost(residual) + UPHILL * width:
            u, residual = u + step, after
        if _cost(residual) < least:
            least, place = _cost(residual), u
        width *= SHRINK if before - least < PAYS else 1.0
        if width < NARROW:
            break
    found = minimise(problem, place, LAST)
    return found if found.cost < fit.cost else fit


def unstuck(fit: Fit) -> Fit:
    """Both cures in turn while they pay; on smooth ground, or of very many samples, neither."""
    for n in range(ROUNDS if _curable(fit) else 0):
        before, fit = fit.cost, across(averaged(fit, n * SCATTERS))
        if before - fit.cost < PAYS:
            break
    return fit


def _curable(fit: Fit) -> bool:
    return np.isfinite(fit.cost) and len(fit.residual) < HEAVY and is_rough(fit)


def _cost(residual: Array) -> float:
    return float(costs(residual[None])[0])


def _usable(residuals: Array, least: float) -> np.ndarray:
    """Which residuals (sets, n) are no run that broke down."""
    return costs(residuals) < FAR * (least + 1)


def _scattered(problem: Problem, u: Array, root: Array, count: int, seed: int) -> Array:
    """Sets (count, size) about u in pairs of opposites, within the limits."""
    half = np.random.default_rng(seed).standard_normal((count // 2, problem.size))
    return np.clip(u + np.vstack([half, -half]) @ root.T, *problem.limits())


def _root(jacobian: Array) -> Array:
    """A root (size, size) of the covariance that a Jacobian stands for."""
    normal = jacobian.T @ jacobian
    scale = 1 / np.sqrt(np.diag(normal) + 1e-300)
    power, turn = np.linalg.eigh(normal * scale[:, None] * scale)
    return np.asarray(scale[:, None] * turn / np.sqrt(np.maximum(power, WEAKEST)))


def softened(fit: Fit) -> Fit:
    """The fit with slopes averaged over one standard deviation, where the ground is rough: what
    its parameters' intervals and forecasts stand on.
    """
    if not _curable(fit):
        return fit
    problem = fit.problem
    jacobian = problem.linearised(fit.u, stretch=LONG)[1]
    for n in range(SOFTER):
        root = _root(jacobian)
        sets = _scattered(problem, fit.u, root, max(SETS, 3 * problem.size), n)
        shown = problem.residual(sets)
        whole = _usable(shown, _cost(fit.residual))
        if whole.sum() <= problem.size + 8:
            return fit
        usable = _those(shown, whole)
        jacobian = _regressed(problem, sets[whole] - fit.u, usable, jacobian)
    return replace(fit, slopes=jacobian)


def _those(residuals: Array, whole: np.ndarray) -> Array:
    """The residuals (sets, n) that are usable; where all are, no copy of them."""
    return residuals if whole.all() else residuals[whole]


def _regressed(problem: Problem, moves: Array, shown: Array, known: Array) -> Array:
    """Slopes (samples + size, size) of residuals ``shown`` (sets, samples + size) over moves (sets,
    size), beside a constant.

    Each run's are regressed on what moves it; those of the priors are ``known``, and those of what
    is held: regressed they are rounding, which holds the residual itself.
    """
    slopes, spread = known.copy(), moves.std(axis=0)
    for run, part in enumerate(problem.parts):
        own = problem.moving(run)
        own = own[spread[own] > 0]
        scale = spread[own]
        moved = np.column_stack([np.ones(len(moves)), moves[:, own] / scale])
        weights = np.linalg.pinv(moved)[1:] / scale[:, None]
        slopes.T[own, part] = weights @ shown[:, part]
    return slopes
