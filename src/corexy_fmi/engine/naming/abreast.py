"""Candidates abreast: what several of them ask for at once shares the kernel's lanes.

A block of eight lanes takes as long with one of them in use.  So what needs residuals asks for them
(`residuals`) and waits; a company of candidates is answered together, and each result is its own.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from itertools import chain
from typing import Any, TypeVar

import numpy as np

from corexy_fmi.engine.fitting.fit import Mapper
from corexy_fmi.engine.fitting.lanes import joined
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import frees_rotor
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.spare import shared

T = TypeVar("T")
Asked = tuple[Problem, Array]  # sets (sets, size) of a problem
Steps = Generator[Asked, Array, T]  # what asks, is sent whitened errors (sets, samples), and ends

TOGETHER = 32  # sets that run at once: what bounds the memory
COMPANY = 8  # candidates that go abreast


def residuals(problem: Problem, sets: Array) -> Steps[Array]:
    """Ask for the whitened errors (sets, samples) of sets (sets, size)."""
    return (yield problem, sets)


def alone(steps: Steps[T]) -> T:
    """The end of what has no company."""
    return abreast([steps])[0]


def abreast(company: Sequence[Steps[T]]) -> list[T]:
    """The end of each, in their order."""
    ends: dict[int, T] = {}
    waiting: list[tuple[int, Asked]] = []

    def go_on(n: int, answer: Any) -> None:
        try:
            waiting.append((n, company[n].send(answer)))
        except StopIteration as end:
            ends[n] = end.value

    for n in range(len(company)):
        go_on(n, None)
    while waiting:
        some = _some([asked for _, asked in waiting])
        chosen = [waiting[n] for n in some]
        waiting[:] = [other for n, other in enumerate(waiting) if n not in some]
        for (n, _), answer in zip(chosen, _answers([a for _, a in chosen]), strict=True):
            go_on(n, answer)
    return [ends[n] for n in range(len(company))]


def in_companies(
    steps_of: Callable[[Problem], Steps[T]], problems: Sequence[Problem], mapper: Mapper = map
) -> list[T]:
    """The end of each problem's steps, in their order; companies go to the mapper."""
    kinds: dict[object, list[int]] = {}
    for n, problem in enumerate(problems):
        kinds.setdefault(_kind(problem), []).append(n)
    companies = [
        alike[first : first + COMPANY]
        for alike in kinds.values()
        for first in range(0, len(alike), COMPANY)
    ]
    found = mapper(lambda c: abreast([steps_of(problems[n]) for n in c]), companies)
    ends = dict(zip(chain(*companies), chain(*found), strict=True))
    return [ends[n] for n in range(len(problems))]


def _kind(problem: Problem) -> object:
    """What is the same of problems that may share lanes: the micro-step, and which rotors turn."""
    if problem.damping or problem.limit <= 0:  # their step depends on who runs beside them
        return id(problem)
    return problem.limit, frees_rotor([i.effect for i in problem.hypothesis.uses])


def _some(waiting: list[Asked]) -> list[int]:
    """Which of those that wait are answered next: the first, and others that may run with it."""
    kind, count, chosen = _kind(waiting[0][0]), 0, list[int]()
    for n, (problem, sets) in enumerate(waiting):
        if not chosen or (count + len(sets) <= TOGETHER and _kind(problem) == kind):
            chosen.append(n)
            count += len(sets)
    return chosen


def _answers(asked: list[Asked]) -> list[Array]:
    """The whitened errors (sets, samples) of each."""
    first, ends = asked[0][0], np.cumsum([len(sets) for _, sets in asked])
    white = np.empty((ends[-1], first.parts[-1].stop))

    def run(r: int) -> None:
        lanes = joined([problem.lanes(sets, r) for problem, sets in asked])
        first.whitened(lanes, r, list(white[:, first.parts[r]]))

    shared(run, range(len(first.runs)))
    return np.split(white, ends[:-1])
