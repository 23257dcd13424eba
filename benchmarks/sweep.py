"""What `corexy sweep` gives on one and two cores, and what a chunk costs the one who collects.

    python -m benchmarks.sweep            measures, writes benchmarks/results/sweep.json, renders
    python -m benchmarks.sweep --render   only renews the figures in docs/sweep.md from that file

One rectangle of yin2018 (a surrogate), four numbers varied, 20 480 sets on each number of cores.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time as clock
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.outcome import write_outcome
from benchmarks.speed import processor, shortest
from benchmarks.sweep_page import render
from corexy_fmi.kernel.call import LANES
from corexy_fmi.machine import load_machine
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.sweep.chunk import Columns, run_chunk
from corexy_fmi.sweep.folder import Folder
from corexy_fmi.sweep.measure import MEASURES
from corexy_fmi.sweep.plan import Plan
from corexy_fmi.sweep.run import sweep
from corexy_fmi.sweep.vary import read_ranges
from corexy_fmi.sweep.workers import workers

VARY = ("belt_axial_stiffness=500:2000:log", "carriage_mass=0.05:0.2:log")
VARY += ("carriage_coulomb_friction=0:0.5", "backlash.motor1.gap=0:0.02")
SHAPE = Rectangle(0.02, 0.015, 0.039)
SETS, CHUNK, CORES = 20480, 1024, (1, 2)
COLLECTED, TASKS, REPEATS = (1024, 4096, 16384), 40, 5


def plan() -> Plan:
    """The sweep that is timed."""
    ranges, machine = read_ranges(VARY, (), load_machine("yin2018"))
    return Plan(machine, SHAPE, ranges, SETS, chunk=CHUNK)


def swept(what: Plan, cores: int) -> dict[str, float]:
    """Seconds of a whole sweep once the workers are there and warm, and until they are."""
    begin = clock.perf_counter()
    with tempfile.TemporaryDirectory() as name, workers(cores) as (executor, ahead):
        folder = Folder(Path(name) / "out", what.document(), {})
        small = Plan(what.machine, what.shape, what.ranges, 8 * LANES, chunk=LANES)
        for future in [executor.submit(run_chunk, small, n) for n in range(small.chunks)]:
            future.result()
        warm = clock.perf_counter()
        sweep(what, folder, folder.open(), executor, ahead)
        end = clock.perf_counter()
        size = sum(file.stat().st_size for file in (Path(name) / "out" / "sets").iterdir())
    return {
        "cores": cores,
        "seconds_to_start": warm - begin,
        "seconds": end - warm,
        "sets_per_second": what.sets / (end - warm),
        "bytes_per_set": size / what.sets,
    }


def table(rows: int) -> Columns:
    """A chunk's table with noise for numbers, which compresses as badly as results do."""
    random, names = np.random.default_rng(0), (*(v.partition("=")[0] for v in VARY), *MEASURES)
    return {"set": np.arange(rows), **{name: random.random(rows) for name in names}}


def collected(what: Plan, rows: int) -> dict[str, float]:
    """Seconds that a chunk costs the collecting process: to hand over and take back, to write."""
    content = table(rows)
    with tempfile.TemporaryDirectory() as name:
        folder = Folder(Path(name), what.document(), {})
        folder.open()
        write = shortest(lambda: folder.keep(0, content), REPEATS)
    with workers(2) as (pool, _):
        for future in [pool.submit(table, LANES) for _ in range(4)]:
            future.result()
        begin = clock.process_time()
        for _ in range(TASKS):
            pool.submit(table, rows).result()
        hand_over = (clock.process_time() - begin) / TASKS
    return {"sets": rows, "write": write, "hand_over": hand_over}


def document() -> dict[str, Any]:
    """All figures."""
    what, load = plan(), os.getloadavg()[0]
    run_chunk(what, 0)
    rows = [swept(what, cores) for cores in CORES]
    return {
        **processor(),
        "machine": "yin2018 (surrogate)",
        "rectangle": "0.02 m x 0.015 m at 0.039 m/s, rows every 1 ms, then 0.5 s of rest",
        "rows": len(what.order().time),
        "vary": VARY,
        "sets": SETS,
        "chunk": CHUNK,
        "load_average_before": load,
        "sweeps": rows,
        "collecting": [collected(what, n) for n in COLLECTED],
    }


def main() -> None:
    """Measure, write, render."""
    if "--render" not in sys.argv[1:]:
        print(write_outcome("sweep", "python -m benchmarks.sweep", document()))
    print(render())


if __name__ == "__main__":
    main()
