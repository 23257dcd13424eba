"""Ratios that tell a slower kernel on any load: against the reference, and against a fixed loop.

    python -m benchmarks.guard

measures them and stores them in benchmarks/results/guard.json under this kind of processor;
`tests/test_guard.py` measures them again and fails where one fell by a third.  To renew them, after
a change that makes the kernel slower or the reference faster on purpose, or for another kind of
processor, run it on a quiet machine and commit the file with the reason.
"""

from __future__ import annotations

import ctypes
import json
import platform
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.outcome import RESULTS, write_outcome
from benchmarks.speed import processor, shortest
from corexy_fmi.kernel.call import LANES, Excitation, run_lanes, step_limit
from corexy_fmi.kernel.compiler import SUFFIX, compile_library, native_flags
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import machine_vector

ALLOWED = 2 / 3  # of the stored ratio
UNITS = ("avx512f", "avx2", "avx", "sse2", "asimd")
MACHINE, ROWS, REFERENCE_ROWS = "yin2018", 1500, 24
ROUNDS, REPEATS, REFERENCE_REPEATS, LOOP_STEPS = 6, 12, 2, 4000
LOOP = """
__attribute__((visibility("default"))) double fixed_loop(int steps) {
  double x[8], v[8];
  for (int i = 0; i < 8; i++) { x[i] = 0.1 * i; v[i] = 0.0; }
  for (int n = 0; n < steps; n++)
    for (int i = 0; i < 8; i++) {
      v[i] = 0.999 * v[i] - 0.01 * x[i] / (1.0 + x[i] * x[i]);
      x[i] += 0.01 * v[i];
    }
  return x[7];
}
"""
Ratios = dict[str, float]


def kind() -> str:
    """The kind of processor that a ratio belongs to: its widest vector unit, maker and family (some
    do a wide operation in one go, some in two).
    """
    units = processor()["vector_units"]
    unit = next((u for u in UNITS if u in units), "scalar")
    return " ".join([platform.machine(), unit, *_family()])


def _family() -> list[str]:
    """Maker and family of this CPU, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    pairs = [(key.strip(), value.strip()) for key, _, value in (x.partition(":") for x in lines)]
    told = dict(reversed(pairs))
    return [told[key] for key in ("vendor_id", "cpu family") if key in told]


def fixed_loop() -> Callable[[], Any]:
    """A compiled loop that never changes: eight damped springs, `LOOP_STEPS` steps."""
    with tempfile.TemporaryDirectory() as name:
        source = Path(name) / "loop.c"
        source.write_text(LOOP)
        compile_library([source], Path(name) / f"loop{SUFFIX}", *native_flags(LANES))
        loop = ctypes.CDLL(str(Path(name) / f"loop{SUFFIX}")).fixed_loop
    loop.restype, loop.argtypes = ctypes.c_double, [ctypes.c_int]
    return lambda: loop(LOOP_STEPS)


def drives() -> tuple[Excitation, Excitation, np.ndarray, float]:
    """The kernel's run, the reference's shorter one, the machine's vector and its step [s]."""
    machine = load_machine(MACHINE)
    order = command(Rectangle(0.02, 0.015, 0.04).motion, machine.parameters["pulley_radius"])
    long, short = (
        Excitation(order.time[:n], order["phi1"][:n], order["phi2"][:n])
        for n in (ROWS, REFERENCE_ROWS)
    )
    vector = machine_vector(machine)
    return long, short, vector, step_limit(bundled_layout(), vector)


def measured(kernel: Callable[..., Any] = run_lanes) -> Ratios:
    """How many times faster one lane of a kernel's step is; least times of interleaved repeats."""
    long, short, vector, limit = drives()
    layout, loop = bundled_layout(), fixed_loop()
    one, eight = vector[None], np.tile(vector, (LANES, 1))
    runs: dict[str, tuple[Callable[[], Any], int, float]] = {
        "one": (lambda: kernel(layout, long, one), REPEATS, ROWS - 1),
        "eight": (lambda: kernel(layout, long, eight), REPEATS, LANES * (ROWS - 1)),
        "loop": (loop, REPEATS, LOOP_STEPS),
        "reference": (
            lambda: run_reference(layout, short, vector, limit=limit),
            REFERENCE_REPEATS,
            REFERENCE_ROWS - 1,
        ),
    }
    times = dict.fromkeys(runs, np.inf)
    for _ in range(ROUNDS):
        for name, (run, repeats, steps) in runs.items():
            times[name] = min(times[name], shortest(run, repeats) / steps)
    return {
        "reference_over_one_lane": times["reference"] / times["one"],
        "loop_over_one_lane": times["loop"] / times["one"],
        "loop_over_one_of_eight_lanes": times["loop"] / times["eight"],
    }


def fallen(found: Mapping[str, float], stored: Mapping[str, float]) -> list[str]:
    """Ratios that are below `ALLOWED` of the stored one."""
    return [name for name, ratio in stored.items() if found[name] < ALLOWED * ratio]


def stored() -> dict[str, Ratios]:
    """Stored ratios by kind of processor."""
    path = RESULTS / "guard.json"
    return json.loads(path.read_text(encoding="utf-8"))["ratios"] if path.exists() else {}


def main() -> None:
    """Measure, print, store: the median of several, since luck must not raise the bar."""
    found = [measured() for _ in range(5)]
    ratios = {name: float(np.median([f[name] for f in found])) for name in found[0]}
    for name, ratio in ratios.items():
        print(f"{name:30s} {ratio:8.3f}   of", *(f"{f[name]:.3f}" for f in found))
    document = {"allowed": ALLOWED, "ratios": stored() | {kind(): ratios}}
    print(write_outcome("guard", "python -m benchmarks.guard", document))


if __name__ == "__main__":
    main()
