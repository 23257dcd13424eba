"""Fits begun from many places: what rings has a minimum for every frequency, a beat apart.

A nominal parameter off by a tenth moves a mode's frequency by some percent; where the recording
holds more than a few of its swings, a fit that begins there ends in the wrong minimum.  Friction
that lets go and catches does the same.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from corexy_fmi.engine.fitting.fit import Fit, Mapper, costs, minimise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.kernel.call import Array

TRIED = 3  # mixtures that are fitted
MANY = 8  # starts of the effects' shapes
SHORT = 3  # iterations of a short fit
TOGETHER = 32  # sets that run at once: what bounds the memory
EVEN = float(np.sqrt(3))  # half width of an even spread of standard deviation 1
FACTOR = 1.0  # log of the factor by which an effect's parameters go either way
SEED = 2018  # of the scrambled sequence


@dataclass(frozen=True)
class Breadth:
    """How many starts are looked at (a power of two), how many of them, the best by the whole
    residual and by each channel's, are fitted, and how many mixtures of those are looked at.
    """

    places: int
    each: int
    children: int


NOMINAL, LEADER = Breadth(256, 6, 64), Breadth(64, 2, 32)


def _spread(problem: Problem, around: Array) -> Array:
    """How far each unknown goes either way, (size,): nominal ones by their priors."""
    width = np.zeros(problem.size)
    for k, unknown in enumerate(problem.unknowns):
        if k < problem.nominal_count:
            width[k] = EVEN * unknown.prior_std if unknown.prior_std < 1.0 else 0.0
        elif unknown.log and not unknown.wave:
            width[k] = FACTOR
        elif unknown.bounds[0] >= 0:
            width[k] = abs(around[k]) * (1 - np.exp(-FACTOR))
    return width


def scattered(problem: Problem, around: Array, places: int) -> Array:
    """Starts (places, size) around one, which is the first; nuisances and phases stay."""
    width = _spread(problem, around)
    moved = np.flatnonzero(width)
    starts = np.repeat(around[None], places, axis=0)
    if len(moved):
        draws = 2 * qmc.Sobol(len(moved), seed=SEED).random(places) - 1
        starts[1:, moved] += width[moved] * draws[1:]
    return np.clip(starts, *problem.limits())


def declared(problem: Problem, around: Array) -> Array:
    """``around`` with the effects' shapes where their files begin them, (starts, size)."""
    known = {x.key: k for k, x in enumerate(problem.unknowns)}
    shapes = [
        (known[key], p.starts)
        for i in problem.hypothesis.uses
        for p in i.effect.parameters
        if not (p.size or p.periodic)
        and (key := f"{i.effect.name}.{i.location}.{p.name}") in known
        and not problem.unknowns[known[key]].wave
    ]
    places = [k for k, _ in shapes]
    rows = list(itertools.islice(itertools.product(*(starts for _, starts in shapes)), MANY))
    found = np.repeat(around[None], len(rows) if shapes else 0, axis=0)
    for row, values in zip(found, rows, strict=bool(shapes)):
        row[places] = [problem.unknowns[k].internal(v) for k, v in zip(places, values, strict=True)]
    return found


def mixed(fits: list[Fit], count: int) -> Array:
    """Children (count, size) of pairs of fits, each unknown from either: axes end apart."""
    random, ends = np.random.default_rng(SEED), np.array([fit.u for fit in fits])
    pairs = random.integers(len(ends), size=(count, 2))
    from_first = random.random((count, ends.shape[1])) < 0.5
    return np.where(from_first, ends[pairs[:, 0]], ends[pairs[:, 1]])


def _parts(problem: Problem, starts: Array, mapper: Mapper = map) -> Array:
    """Costs (1 + channels, sets): all of the residual, and each channel's part over all runs."""
    names = [s.channel for run in problem.runs for s in run.samples]
    ends = np.cumsum([len(s.index) for run in problem.runs for s in run.samples])

    def found(part: Array) -> list[Array]:
        residual = problem.residual(part)
        pieces = np.split(residual[:, : ends[-1]], ends[:-1], axis=1)
        rows = [np.hstack([p for p, n in zip(pieces, names, strict=True) if n == one])
                for one in sorted(set(names))]  # fmt: skip
        return [costs(residual), *map(costs, rows)]

    groups = np.split(starts, range(TOGETHER, len(starts), TOGETHER))
    return np.concatenate(list(mapper(found, groups)), axis=1)


def _shorts(problem: Problem, starts: Iterable[Array], mapper: Mapper) -> list[Fit]:
    """Short fits without their Jacobians: many are kept at once."""
    return list(mapper(lambda u: minimise(problem, u, SHORT), starts))


def begun(
    problem: Problem, around: Array, breadth: Breadth = NOMINAL, mapper: Mapper = map
) -> list[Fit]:
    """Short fits: from ``around`` first, from the best of scattered starts, from where the effects'
    files begin, and from mixtures of those.
    """
    starts = scattered(problem, around, breadth.places)
    orders = np.argsort(_parts(problem, starts, mapper), axis=1, kind="stable")
    chosen = list(dict.fromkeys([0, *orders[:, : breadth.each].ravel().tolist()]))
    fits = _shorts(problem, (*starts[chosen], *declared(problem, around)), mapper)
    children = mixed(fits, breadth.children)
    order = np.argsort(_parts(problem, children, mapper)[0], kind="stable")[:TRIED]
    return fits + _shorts(problem, children[order], mapper)


def best(fits: list[Fit]) -> Fit:
    """The fit of least cost; of equal ones the first."""
    return min(fits, key=lambda fit: fit.cost)
