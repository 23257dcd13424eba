"""What a run costs in Python, where no C compiler is at hand, beside the kernel.

    python -m benchmarks.without_compiler

One rectangle of yin2018 (a surrogate) in each fidelity; the kernel runs eight sets at once.  CPU
time of this process, the least of three.  Writes benchmarks/results/without_compiler.json.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.outcome import write_outcome
from benchmarks.speed import processor
from corexy_fmi.kernel.call import LANES, run_lanes, step_limit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import excitation, machine_vector

SHAPE, REPEATS = Rectangle(0.006, 0.004, 0.04), 3


def shortest(run: Callable[[], Any]) -> float:
    """Least CPU time [s] of several runs; one more goes before."""
    run()
    times = []
    for _ in range(REPEATS):
        begin = clock.process_time()
        run()
        times.append(clock.process_time() - begin)
    return min(times)


def row(fidelity: str) -> dict[str, Any]:
    """Microseconds for a row of one set, both ways."""
    machine = replace(load_machine("yin2018"), fidelity=fidelity)
    order = command(SHAPE.motion, machine.parameters["pulley_radius"])
    drive, vector = excitation(machine, order), machine_vector(machine)
    limit, layout = step_limit(bundled_layout(), vector, fidelity=machine.stage), bundled_layout()
    sets, rows = np.tile(vector, (LANES, 1)), len(drive.time)
    eight = shortest(lambda: run_lanes(layout, drive, sets, fidelity=machine.stage, limit=limit))
    slow = shortest(
        lambda: run_reference(layout, drive, vector, fidelity=machine.stage, limit=limit)
    )
    each = {"kernel_us": 1e6 * eight / LANES / rows, "python_us": 1e6 * slow / rows}
    return {
        "fidelity": fidelity,
        "rows": rows,
        **each,
        "times": each["python_us"] / each["kernel_us"],
    }


def main() -> None:
    """Measure, write."""
    rows = [row(fidelity) for fidelity in ("full", "reduced", "kinematic")]
    for line in rows:
        print(line)
    about = {**processor(), "machine": "yin2018 (surrogate)"}
    print(
        write_outcome(
            "without_compiler", "python -m benchmarks.without_compiler", about | {"rows": rows}
        )
    )


if __name__ == "__main__":
    main()
