"""The same step in CasADi: symbolic, its generated C compiled and run."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.exact_stage import Array
from benchmarks.peer_case import FREE, MOTORS, ROW, Case
from corexy_fmi.kernel.compiler import find_compiler


def casadi_run(case: Case, count: int) -> Callable[[], Array]:
    """One trajectory: micro-steps folded into a row, rows accumulated, all in generated C."""
    import casadi

    rows = len(case.travel) - 1
    row = _step(casadi, case, count).fold(count)
    whole = row.mapaccum("whole", rows)
    with tempfile.TemporaryDirectory() as folder:
        run = casadi.external("whole", _compiled(whole, Path(folder)))
    shares = (np.arange(count) + 0.5) / count
    rise = np.diff(case.travel, axis=0)
    given = (case.travel[:-1, None, :] + shares[:, None] * rise[:, None, :]).reshape(-1, 2).T
    start, begin = np.concatenate([case.start(), np.zeros(10)]), case.start()[:2]
    drive = casadi.DM(given)

    def once() -> Array:
        states = run(start, drive)
        return np.vstack([begin, np.asarray(states)[:2].T])

    return once


def _step(casadi, case: Case, count: int):  # type: ignore[no-untyped-def]
    """State of travels and speeds, motors' travel in the middle -> state, after one micro-step."""
    keep, push, slip = case.kick(ROW / count)
    half = ROW / count / 2
    state, motors = casadi.SX.sym("state", 20), casadi.SX.sym("motors", 2)
    q, v = state[:10] + half * state[10:], state[10:]
    tensions = case.stiffness * (case.rows[:, FREE] @ q + case.rows[:, MOTORS] @ motors)
    fast = keep * v - push * (case.rows[:, FREE].T @ tensions)
    kicked = fast - casadi.fmax(-slip, casadi.fmin(fast, slip))
    end = casadi.vertcat(q + half * kicked, kicked)
    return casadi.Function("step", [state, motors], [end])


def _compiled(function, folder: Path) -> str:  # type: ignore[no-untyped-def]
    """The shared library of a function's generated C."""
    here = Path.cwd()
    os.chdir(folder)  # CasADi writes beside the process
    try:
        function.generate("whole.c")
        flags = ["-O3", "-march=native", "-ffast-math", "-fPIC", "-shared"]
        subprocess.run([*find_compiler(), *flags, "whole.c", "-o", "whole.so", "-lm"], check=True)
    finally:
        os.chdir(here)
    return str(folder / "whole.so")
