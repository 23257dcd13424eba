"""This project's kernel and the numba port on a batch of parameter sets, on one core and on two."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np

from benchmarks.exact_stage import Array
from benchmarks.peer_case import ROW, Case
from benchmarks.peer_scheme import arguments, compiled_batch
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine

VARIED = {"carriage_mass": 0.2, "belt_axial_stiffness": 0.1, "bridge_viscous_friction": 0.3}


@cache
def batch_cases(name: str, sets: int) -> tuple[Case, ...]:
    """A machine's case with numbers drawn about its own, the same at every call."""
    random, machine = np.random.default_rng(0), load_machine(name)
    cases = []
    for _ in range(sets):
        drawn = {key: 1 + spread * random.uniform(-1, 1) for key, spread in VARIED.items()}
        parameters = {k: v * drawn.get(k, 1.0) for k, v in machine.parameters.items()}
        cases.append(Case(replace(machine, parameters=parameters)))
    return tuple(cases)


def lanes_run(case: Case, lanes: int, limit: float = 0.0) -> Callable[[], Array]:
    """The kernel with so many equal sets; the path of the first."""
    vectors = np.tile(case.vector, (lanes, 1))
    run = lambda: run_lanes(bundled_layout(), case.drive, vectors, limit=limit)[0].T  # noqa: E731
    run()
    return run


def kernel_batch(name: str, sets: int) -> Callable[[], Array]:
    """The kernel over a batch; all paths (sets, 2, rows)."""
    cases, own = batch_cases(name, sets), Case.named(name)
    vectors = np.array([case.vector for case in cases])
    drive, limit = own.drive, ROW / own.count
    return lambda: run_lanes(bundled_layout(), drive, vectors, limit=limit)


def numba_batch(name: str, sets: int, parallel: bool) -> Callable[[], Array]:
    """The numba port over a batch, what follows from the parameters worked out before."""
    cases, own = batch_cases(name, sets), Case.named(name)
    given = list(arguments(own, own.count))
    given[2] = np.array([case.stiffness for case in cases])
    kicks = [case.kick(ROW / own.count) for case in cases]
    given[3:6] = [np.array(column) for column in zip(*kicks, strict=True)]
    given[-1] = np.empty((sets, len(own.travel), 2))
    run = compiled_batch(True, parallel)
    run(*given)

    def once() -> Array:
        run(*given)
        return np.asarray(given[-1].transpose(0, 2, 1))

    return once


_RUNS: dict[tuple[str, int], Callable[[], Array]] = {}


def _part(name: str, sets: int, times: int) -> float:
    """What a process does: the same batch some times; a number that depends on all paths."""
    run = _RUNS.setdefault((name, sets), kernel_batch(name, sets))
    return sum(float(run().sum()) for _ in range(times))


@contextmanager
def processes(name: str, sets: int, cores: int, times: int) -> Iterator[Callable[[], float]]:
    """Seconds for the kernel over ``times`` batches on each of so many processes, warm."""
    with ProcessPoolExecutor(cores) as pool:

        def once() -> float:
            begin = clock.perf_counter()
            done = [pool.submit(_part, name, sets, times) for _ in range(cores)]
            for future in done:
                future.result()
            return clock.perf_counter() - begin

        for _ in range(3):
            once()
        yield once
