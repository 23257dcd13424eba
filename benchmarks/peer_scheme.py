"""This project's own scheme in other hands: a loop of NumPy, and a port to numba.

The port is written by this file, every section and coordinate on its own line, in travels instead
of angles (fewer products than the kernel's), so that a compiler keeps all of it in registers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from benchmarks.exact_stage import Array
from benchmarks.peer_case import FREE, ROW, Case
from corexy_fmi.topology import FULL

LOOP = """
def run(travel, count, stiffness, keep, push, slip, start, half, out):
{load}
    out[0, 0] = q0
    out[0, 1] = q1
    for row in range(len(travel) - 1):
        rise2 = (travel[row + 1, 0] - travel[row, 0]) / count
        rise3 = (travel[row + 1, 1] - travel[row, 1]) / count
        for n in range(count):
            q2 = travel[row, 0] + (n + 0.5) * rise2
            q3 = travel[row, 1] + (n + 0.5) * rise3
{step}
        out[row + 1, 0] = q0
        out[row + 1, 1] = q1
"""


def _sum(terms: list[tuple[int, str]]) -> str:
    return " ".join(f"{'-' if weight < 0 else '+'} {name}" for weight, name in terms)


def step_lines() -> list[str]:
    """The step's statements: drift, tensions, kick, drift."""
    place = {name: i for i, name in enumerate(FULL.coordinates)}
    lines = [f"q{i} += half * v{i}" for i in FREE]
    for n, section in enumerate(FULL.sections):
        terms = _sum([(w, f"q{place[c]}") for c, w in section.row.items()])
        lines.append(f"t{n} = k{n} * ({terms})")
    for i in FREE:
        name = FULL.coordinates[i]
        pulls = [(-s.row[name], f"t{n}") for n, s in enumerate(FULL.sections) if name in s.row]
        lines += [f"fast = keep{i} * v{i} + push{i} * ({_sum(pulls)})",
                  f"v{i} = fast - copysign(min(abs(fast), slip{i}), fast)",
                  f"q{i} += half * v{i}"]  # fmt: skip
    return lines


def source() -> str:
    """The whole run as Python."""
    load = [f"k{n} = stiffness[{n}]" for n in range(len(FULL.sections))]
    for at, i in enumerate(FREE):
        load += [f"{name}{i} = {name}[{at}]" for name in ("keep", "push", "slip")]
        load += [f"q{i} = start[{at}]", f"v{i} = 0.0"]
    pad = lambda lines, depth: "\n".join("    " * depth + line for line in lines)  # noqa: E731
    return LOOP.format(load=pad(load, 1), step=pad(step_lines(), 3))


def plain() -> Callable[..., None]:
    """The run in plain Python."""
    space: dict[str, Any] = {"copysign": np.copysign}
    exec(source(), space)
    return space["run"]  # type: ignore[no-any-return]


@cache
def compiled(fast: bool) -> Callable[..., None]:
    """The run compiled by numba, with its fastmath or exact."""
    import numba

    return numba.njit(plain(), fastmath=fast)  # type: ignore[no-any-return]


@cache
def compiled_batch(fast: bool, parallel: bool) -> Callable[..., None]:
    """The run for many parameter sets, one after the other, or on all threads."""
    import numba

    run, span = compiled(fast), numba.prange

    @numba.njit(fastmath=fast, parallel=parallel)  # type: ignore[untyped-decorator]
    def batch(travel, count, stiffness, keep, push, slip, start, half, out):  # type: ignore[no-untyped-def]
        for n in span(len(keep)):
            run(travel, count, stiffness[n], keep[n], push[n], slip[n], start, half, out[n])

    return batch  # type: ignore[no-any-return]


def arguments(case: Case, count: int) -> tuple[Any, ...]:
    """What a run takes, its last the path to fill."""
    step = ROW / count
    out = np.empty((len(case.travel), 2))
    return case.travel, count, case.stiffness, *case.kick(step), case.start(), step / 2, out


def numba_run(case: Case, count: int, fast: bool = True) -> Callable[[], Array]:
    """One trajectory; compiled when this returns."""
    given, run = arguments(case, count), compiled(fast)
    run(*given)

    def once() -> Array:
        run(*given)
        return np.asarray(given[-1])

    return once


def numpy_run(case: Case, count: int) -> Callable[[], Array]:
    """A loop of vectors of ten."""
    _, _, _, k, k_motor = case.terms()
    keep, push, slip = case.kick(ROW / count)
    half, shares = ROW / count / 2, (np.arange(count) + 0.5) / count

    def once() -> Array:
        q, v, path = case.start(), np.zeros(10), [case.start()[:2]]
        for now, then in zip(case.travel[:-1], case.travel[1:], strict=True):
            for pull in (now + shares[:, None] * (then - now)) @ k_motor.T:
                q += half * v
                v = keep * v - push * (k @ q + pull)
                v -= np.clip(v, -slip, slip)
                q += half * v
            path.append(q[:2].copy())
        return np.array(path)

    return once


def _loops(travel, count, k, k_motor, keep, push, slip, start, half, out):  # type: ignore[no-untyped-def]
    """The scheme as one would type it: loops over a matrix."""
    free, q, v = len(start), start.copy(), np.zeros(len(start))
    out[0] = q[:2]
    for row in range(len(travel) - 1):
        for n in range(count):
            share = (n + 0.5) / count
            first = travel[row, 0] + share * (travel[row + 1, 0] - travel[row, 0])
            second = travel[row, 1] + share * (travel[row + 1, 1] - travel[row, 1])
            for i in range(free):
                q[i] += half * v[i]
            for i in range(free):
                force = -k_motor[i, 0] * first - k_motor[i, 1] * second
                for j in range(free):
                    force -= k[i, j] * q[j]
                fast = keep[i] * v[i] + push[i] * force
                v[i] = fast - np.copysign(min(abs(fast), slip[i]), fast)
            for i in range(free):
                q[i] += half * v[i]
        out[row + 1] = q[:2]


@cache
def _compiled_loops() -> Callable[..., None]:
    import numba

    return numba.njit(_loops, fastmath=True)  # type: ignore[no-any-return]


def loops_run(case: Case, count: int) -> Callable[[], Array]:
    """One trajectory by numba's plain loops; compiled when this returns."""
    _, _, _, k, k_motor = case.terms()
    out, run = np.empty((len(case.travel), 2)), _compiled_loops()
    kick, half = case.kick(ROW / count), ROW / count / 2
    given = (case.travel, count, np.ascontiguousarray(k), np.ascontiguousarray(k_motor))
    run(*given, *kick, case.start(), half, out)

    def once() -> Array:
        run(*given, *kick, case.start(), half, out)
        return out

    return once
