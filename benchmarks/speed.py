"""How fast one lane and eight lanes of the kernel are, against SciPy's LSODA at equal accuracy.

    python -m benchmarks.speed

runs one rectangle on each machine, all in one go on the same cores: the kernel at its automatic
step (error against an exact solution is shown) and LSODA at the cheapest tolerances that keep
2 um.  Times are the least of several runs.  Writes benchmarks/results/speed.json.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.exact_stage import Array, Side, command, exact_run, rectangle
from benchmarks.outcome import write_outcome
from benchmarks.smooth_stage import SmoothStage
from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import LANES, Excitation, run_lanes, step_limit
from corexy_fmi.kernel.compiler import FLAGS, cpu_name, find_compiler, native_flags
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.simulate import machine_vector

MACHINES, ALLOWED = ("yin2018", "light_bench", "gt2_printer"), 2.0  # [um]
WIDTH, HEIGHT, SPEED, ROW = 0.02, 0.01, 0.04, 1e-3  # [m], [m], [m/s], [s]
WIDTHS, TOLERANCES = (3e-6, 1e-6, 3e-7), (1e-3, 1e-4, 1e-5)  # of tanh(v / width) [m/s]; rtol
REPEATS, LSODA_REPEATS = 30, 2
Times = dict[str, float]


def shortest(run: Callable[[], Any], repeats: int) -> float:
    """Least wall time [s] of several runs; one more goes before."""
    run()
    times = []
    for _ in range(repeats):
        begin = clock.perf_counter()
        run()
        times.append(clock.perf_counter() - begin)
    return min(times)


def kernel_times(drive: Excitation, vector: Array) -> Times:
    """Seconds for a run of one lane, and for each lane of eight."""
    layout = bundled_layout()
    one, eight = (partial(run_lanes, layout, drive, np.tile(vector, (n, 1))) for n in (1, LANES))
    return {
        "one_lane": shortest(one, REPEATS),
        "of_eight_lanes": shortest(eight, REPEATS) / LANES,
    }


def lsoda(machine: Machine, start: Array, sides: list[Side], exact: Array, jacobian: bool) -> Any:
    """The fastest LSODA run within ALLOWED: seconds, error [um], width, rtol; None if none is."""
    found = []
    for width in WIDTHS:
        for rtol in TOLERANCES:
            stage = SmoothStage(machine.parameters, width)
            options: dict[str, Any] = {"rtol": rtol, "atol": 1e-3 * rtol}
            options |= {"jac": stage.jacobian} if jacobian else {}
            run = partial(stage.run, start, sides, ROW, "LSODA", **options)
            error = float(1e6 * np.abs(run() - exact).max())
            if error <= ALLOWED:
                found.append((shortest(run, LSODA_REPEATS), error, width, rtol))
    names = ("seconds", "error_um", "width", "rtol")
    return dict(zip(names, min(found), strict=True)) if found else None


def measure(name: str) -> dict[str, Any]:
    """All figures of one machine."""
    machine, layout = load_machine(name), bundled_layout()
    start, sides = rectangle(WIDTH, HEIGHT, SPEED, machine.parameters["pulley_radius"], ROW)
    exact, _ = exact_run(machine.parameters, start, sides, ROW)
    rows, angles = command(start, sides, ROW)
    drive, vector = Excitation(rows, *angles.T), machine_vector(machine, layout)
    path = run_lanes(layout, drive, vector[None])[0].T
    times, limit = kernel_times(drive, vector), step_limit(layout, vector)
    steps = (len(rows) - 1) * np.ceil(ROW / limit - 1e-9)
    peers = {
        kind: lsoda(machine, start, sides, exact, kind == "lsoda_with_jacobian")
        for kind in ("lsoda", "lsoda_with_jacobian")
    }
    return {
        "machine": name,
        "duration": float(rows[-1]),
        "step": float(ROW / np.ceil(ROW / limit - 1e-9)),
        "error_um": float(1e6 * np.abs(path - exact).max()),
        **times,
        "ns_per_step": {kind: 1e9 * seconds / steps for kind, seconds in times.items()},
        "times_real_time": float(rows[-1]) / times["one_lane"],
        "eight_over_one": times["one_lane"] / times["of_eight_lanes"],
        **peers,
        **{f"{k}_over_one_lane": p and p["seconds"] / times["one_lane"] for k, p in peers.items()},
    }


def effect_times() -> dict[str, Times]:
    """ns per lane and step with one effect on, yin2018."""
    machine, layout, found = load_machine("yin2018"), bundled_layout(), {}
    start, sides = rectangle(WIDTH, HEIGHT, SPEED, machine.parameters["pulley_radius"], ROW)
    rows, angles = command(start, sides, ROW)
    drive = Excitation(rows, *angles.T)
    for effect in catalogue().values():
        vector = machine_vector(machine, layout)
        first = layout.find(effect.name, next(iter(effect.locations))).parameter
        vector[first : first + len(effect.parameters)] = [p.starts[0] for p in effect.parameters]
        steps = (len(rows) - 1) * np.ceil(ROW / step_limit(layout, vector) - 1e-9)
        times = kernel_times(drive, vector)
        found[effect.name] = {kind: 1e9 * s / steps for kind, s in times.items()}
    return found


def processor() -> dict[str, Any]:
    """Model and vector units of this CPU, compiler and flags."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    model = next((x.partition(":")[2].strip() for x in lines if x.startswith("model name")), "")
    units = [u for u in ("sse2", "avx", "avx2", "fma", "avx512f", "asimd") if u in cpu_name()]
    flags = [*find_compiler(), *FLAGS, *native_flags(LANES)]
    return {"cpu": model or cpu_name(), "vector_units": units, "compiler": " ".join(flags)}


def sentence(r: dict[str, Any]) -> str:
    """One machine's figures in words."""
    ns, peers = r["ns_per_step"], ("lsoda", "lsoda_with_jacobian")
    ratios = [
        f"{k} takes {r[f'{k}_over_one_lane'] or float('nan'):.0f} times one lane" for k in peers
    ]
    return (
        f"{r['machine']}: step {1e3 * r['step']:.3f} ms, error {r['error_um']:.3f} um;"
        f" one lane {ns['one_lane']:.1f} ns, of eight {ns['of_eight_lanes']:.2f} ns per step"
        f" ({r['eight_over_one']:.1f} times the throughput); {r['times_real_time']:.0f} times real"
        f" time; {', '.join(ratios)}"
    )


def main() -> None:
    """Measure, print, write."""
    host = processor()
    print(f"{host['cpu']} ({' '.join(host['vector_units'])}); {host['compiler']}")
    rows = [measure(name) for name in MACHINES]
    for r in rows:
        print(sentence(r))
    effects = effect_times()
    for name, times in effects.items():
        one, eight = times["one_lane"], times["of_eight_lanes"]
        print(f"  {name:28s} one lane {one:6.1f} ns, of eight {eight:6.2f} ns per step")
    run = f"rectangle {WIDTH} m x {HEIGHT} m at {SPEED} m/s, rows every {ROW} s, full, stepper"
    document = {**host, "run": run, "allowed_um": ALLOWED, "machines": rows, "effects": effects}
    print(write_outcome("speed", "python -m benchmarks.speed", document))


if __name__ == "__main__":
    main()
