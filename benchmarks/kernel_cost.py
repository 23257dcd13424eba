"""What the kernel's time goes into: lanes, length, effects; how near it is to the core's peak."""

from __future__ import annotations

import ctypes
import re
import tempfile
import time as clock
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.exact_stage import Array
from benchmarks.peer_case import ROW, Case
from benchmarks.speed import shortest
from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import LANES, Excitation, run_lanes
from corexy_fmi.kernel.compiler import SUFFIX, compile_library, native_flags
from corexy_fmi.kernel.layout import Layout, bundled_layout, make_layout
from corexy_fmi.kernel.topology_code import topology_code
from corexy_fmi.simulate import machine_vector

SETS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
LENGTHS = (1, 2, 4, 8)
STEP = 1e-4  # [s] of the runs with effects
PEAK = """
typedef double wide __attribute__((vector_size(8 * WIDTH)));
__attribute__((visibility("default"))) double fused(long n) {
  wide a[12], b, c;
  for (int i = 0; i < WIDTH; i++) b[i] = 0.999999, c[i] = 1e-9;
  for (int k = 0; k < 12; k++) for (int i = 0; i < WIDTH; i++) a[k][i] = 0.1 * k;
  for (long m = 0; m < n; m++) {STEPS}
  double s = 0;
  for (int k = 0; k < 12; k++) for (int i = 0; i < WIDTH; i++) s += a[k][i];
  return s;
}
"""
FUSED = "\n    a[{k}] = a[{k}] * b + c;"
LOCAL = {"drifted": (2, 0), "kicked_free": (4, 3)}  # sums and products; least, size and sign
REST = 2 * 2 + 2 * (4 + 2) + 2 * 2  # command; x, y kicked and drifted; motors drifted
REST_OTHER = 2 * 3


def peak(fused: bool) -> float:
    """Floating-point operations of one core per second: fused, or a product and then a sum."""
    source = PEAK.replace("{STEPS}", "{" + "".join(FUSED.format(k=k) for k in range(12)) + "\n  }")
    contract = "-ffp-contract=fast" if fused else "-ffp-contract=off"
    with tempfile.TemporaryDirectory() as name:
        file, library = Path(name) / "peak.c", Path(name) / f"peak{SUFFIX}"
        file.write_text(source)
        compile_library([file], library, *native_flags(LANES), contract, f"-DWIDTH={LANES}")
        loop = ctypes.CDLL(str(library)).fused
    loop.restype, loop.argtypes = ctypes.c_double, [ctypes.c_long]
    count = 2_000_000
    return 2 * 12 * LANES * count / shortest(lambda: loop(count), 8)


def operations() -> dict[str, int]:
    """Operations of one micro-step of the full model, counted in the generated C."""
    code = topology_code()
    body = code[code.index("void full_find_forces_as") :]
    body = body[: body.index("\n}\n")]
    sums, other = REST, REST_OTHER
    for line in body.splitlines():
        if " half = " in line:  # once for all lanes
            continue
        value = line.partition(" = ")[2].strip()
        value = re.sub(r"\w+->\w+(\[\w+\])+", "s", value)
        for name, (plain, rest) in LOCAL.items():
            if name in value:
                sums, other = sums + plain, other + rest
        value = re.sub(r"(^|[(,=?:])\s*-", r"\1", value)
        sums += len(re.findall(r"[-+*]", value))
    return {"sums_and_products": sums, "least_size_sign": other}


def nanoseconds(case: Case, lanes: int, layout: Layout, vector: Array, repeats: int) -> float:
    """Of one lane's micro-step; rows are 20 ms apart, so that steps are all that counts."""
    take = slice(None, None, 20)
    e = case.drive
    drive = Excitation(e.time[take].copy(), e.input1[take].copy(), e.input2[take].copy())
    vectors = np.tile(vector, (lanes, 1))
    steps = round(float(drive.time[-1]) / STEP)
    run = lambda: run_lanes(layout, drive, vectors, limit=STEP)  # noqa: E731
    return 1e9 * shortest(run, repeats) / steps / lanes


def share_of_peak(case: Case, repeats: int) -> dict[str, Any]:
    """Operations a second of eight lanes over what the core can do."""
    counted = operations()
    lane = nanoseconds(case, LANES, bundled_layout(), case.vector, repeats)
    rate = counted["sums_and_products"] / (1e-9 * lane)
    best, plain = peak(True), peak(False)
    return {
        **counted,
        "ns_per_lane_step": lane,
        "gflops": 1e-9 * rate,
        "peak_fused_gflops": 1e-9 * best,
        "peak_unfused_gflops": 1e-9 * plain,
        "of_fused": rate / best,
        "of_unfused": rate / plain,
    }


def over_sets(case: Case, repeats: int) -> dict[str, float]:
    """Seconds of a call over its number of parameter sets."""
    layout = bundled_layout()
    runs = {n: np.tile(case.vector, (n, 1)) for n in SETS}
    return {
        str(n): shortest(lambda v=v: run_lanes(layout, case.drive, v), repeats)  # type: ignore[misc]
        for n, v in runs.items()
    }


def over_length(case: Case, repeats: int) -> dict[str, float]:
    """Seconds of a one-lane call over the simulated time [s]: the rectangle again and again."""
    found = {}
    for n in LENGTHS:
        drive = _repeated(case, n)
        run = lambda d=drive: run_lanes(bundled_layout(), d, case.vector[None])  # noqa: E731
        found[f"{drive.time[-1]:.3f}"] = shortest(run, repeats)
    return found


def over_effects(case: Case, repeats: int) -> dict[str, dict[str, float]]:
    """ns per lane and step with the catalogue's first effects on, at `STEP`."""
    layout, vector, found = bundled_layout(), case.vector.copy(), {}
    known = [e for e in catalogue().values() if {"stepper"} <= set(e.drives)]
    marks = sorted({0, 1, 2, 4, 8, 16, len(known)})
    for n in range(len(known) + 1):
        if n in marks:
            found[str(n)] = _both(case, layout, vector, repeats)
        if n < len(known):
            effect = known[n]
            first = layout.find(effect.name, next(iter(effect.locations))).parameter
            vector[first : first + len(effect.parameters)] = [
                p.starts[0] for p in effect.parameters
            ]
    return found


def _both(case: Case, layout: Layout, vector: Array, repeats: int) -> dict[str, float]:
    lanes = {"one_lane": 1, "of_eight_lanes": LANES}
    return {k: nanoseconds(case, n, layout, vector, repeats) for k, n in lanes.items()}


def off_effects(case: Case, rounds: int) -> dict[str, Mapping[str, float]]:
    """A kernel with the whole catalogue, all off, against one compiled without any.

    Both on a short run and on one eight times as long, in turns: what a step costs more, as a
    ratio, and what a call costs more [us].  ``against_itself`` is that ratio for two copies of the
    run without effects: what the clock cannot tell.
    """
    layouts = {"bundled": bundled_layout(), "bare": make_layout({}), "again": make_layout({})}
    drives, found = [_repeated(case, n) for n in (1, LENGTHS[-1])], {}
    for name, lanes in (("one_lane", 1), ("eight_lanes", LANES)):
        runs = {
            (key, n): _run(case, layout, lanes, drive)
            for key, layout in layouts.items()
            for n, drive in enumerate(drives)
        }
        times = dict.fromkeys(runs, np.inf)
        for _ in range(rounds):
            for key, run in runs.items():
                times[key] = min(times[key], _seconds(run))
        slope = {k: times[k, 1] - times[k, 0] for k in layouts}
        call = {k: times[k, 0] - slope[k] / (LENGTHS[-1] - 1) for k in layouts}
        found[name] = {
            "off_over_absent": slope["bundled"] / slope["bare"],
            "against_itself": slope["again"] / slope["bare"],
            "more_a_call_us": 1e6 * (call["bundled"] - call["bare"]),
        }
    return found


def _repeated(case: Case, times: int) -> Excitation:
    """The rectangle again and again."""
    angles = [np.tile(a, times) for a in (case.drive.input1, case.drive.input2)]
    return Excitation(ROW * np.arange(float(len(angles[0]))), *angles)


def _run(case: Case, layout: Layout, lanes: int, drive: Excitation) -> Callable[[], Array]:
    vectors = np.tile(machine_vector(case.machine, layout), (lanes, 1))
    run_lanes(layout, drive, vectors)
    return lambda: run_lanes(layout, drive, vectors)


def _seconds(run: Callable[[], Any]) -> float:
    begin = clock.perf_counter()
    run()
    return clock.perf_counter() - begin
