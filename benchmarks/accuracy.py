"""How far the kernel's rectangle runs are from an exact solution, and how fast that shrinks.

    python -m benchmarks.accuracy

compares every bundled stepper machine at two speeds with `exact_stage` (exact between events), at
the automatic step and at halved steps; then every effect at the automatic step with the kernel's
own run at a fine one; writes benchmarks/results/accuracy.json.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.exact_stage import Array, command, exact_run, rectangle
from benchmarks.outcome import write_outcome
from corexy_fmi.kernel.call import Excitation, run_lanes, step_limit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.simulate import machine_vector

MACHINES, SPEEDS = ("yin2018", "light_bench", "gt2_printer"), (0.04, 0.08)  # [m/s]
WIDTH, HEIGHT, ROW = 0.04, 0.02, 1e-3  # [m], [m], [s]
STEPS = tuple(2e-4 / 2**n for n in range(7))  # [s]


FINE = 2e-6  # [s] step that runs with an effect are compared with


def compare(name: str, speed: float) -> dict[str, Any]:
    """Largest error [um] of x and y at the automatic step and at each of STEPS."""
    machine, layout = load_machine(name), bundled_layout()
    start, sides = rectangle(WIDTH, HEIGHT, speed, machine.parameters["pulley_radius"], ROW)
    exact, stage = exact_run(machine.parameters, start, sides, ROW)
    time, angles = command(start, sides, ROW)
    drive, vector = Excitation(time, *angles.T), machine_vector(machine, layout)

    def error(limit: float) -> float:
        found: Array = run_lanes(layout, drive, vector[None], limit=limit)[0].T
        return float(1e6 * np.abs(found - exact).max())

    errors = {f"{step:.3e}": error(step) for step in STEPS}
    slope = np.polyfit(np.log(STEPS), np.log(list(errors.values())), 1)[0]
    return {
        "machine": name,
        "speed": speed,
        "events": stage.events,
        "automatic_step": step_limit(layout, vector),
        "automatic_error_um": error(0.0),
        "error_um": errors,
        "order": float(slope),
    }


def with_effects(name: str) -> dict[str, float]:
    """Largest error [um] at the automatic step with one effect on, at each set of its starts."""
    machine, layout, found = load_machine(name), bundled_layout(), {}
    start, sides = rectangle(WIDTH, HEIGHT, SPEEDS[-1], machine.parameters["pulley_radius"], ROW)
    time, angles = command(start, sides, ROW)
    drive = Excitation(time, *angles.T)
    for instance in layout.instances:
        parameters, worst = instance.effect.parameters, 0.0
        for which in range(max(len(p.starts) for p in parameters)):
            vector = machine_vector(machine, layout)
            values = [p.starts[min(which, len(p.starts) - 1)] for p in parameters]
            vector[instance.parameter : instance.parameter + len(values)] = values
            coarse, fine = (run_lanes(layout, drive, vector[None], limit=h) for h in (0.0, FINE))
            worst = max(worst, float(1e6 * np.abs(coarse - fine).max()))
        found[f"{instance.effect.name} {instance.location}"] = worst
    return found


def main() -> None:
    """Measure, print, write."""
    rows = [compare(name, speed) for name in MACHINES for speed in SPEEDS]
    print("machine      speed  events  step [ms]  error [um]  order over STEPS")
    for r in rows:
        step, error = 1e3 * r["automatic_step"], r["automatic_error_um"]
        text = f"{r['machine']:12s} {r['speed']:.2f} {r['events']:7d} {step:10.3f} {error:11.4f}"
        print(f"{text} {r['order']:8.2f}")
    effects = {name: with_effects(name) for name in MACHINES}
    for name, errors in effects.items():
        worst = sorted(errors.items(), key=lambda item: -item[1])[:5]
        print(f"{name}, worst with an effect [um]:", ", ".join(f"{k} {v:.2f}" for k, v in worst))
    run = f"rectangle {WIDTH} m x {HEIGHT} m, rows every {ROW} s, 12 degrees of freedom, stepper"
    command_line = "python -m benchmarks.accuracy"
    print(
        write_outcome("accuracy", command_line, {"run": run, "rows": rows, "effects_um": effects})
    )


if __name__ == "__main__":
    main()
