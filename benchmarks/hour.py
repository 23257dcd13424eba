"""What a long recording costs: minutes at 1 kHz diagnosed by the command, its time and memory.

    python -m benchmarks.hour            an hour (3.6 million rows)
    python -m benchmarks.hour 6 12       so many minutes, one after the other

Each is a run of yin2018 (a surrogate) with backlash at motor 1, nominal parameters off the machine
file by some 10 %, and white noise of 20 um.  The recordings are made here and not kept.  Adds its
rows to benchmarks/results/hour.json.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time as clock
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.outcome import RESULTS, write_outcome
from benchmarks.speed import processor
from corexy_fmi.machine import EffectUse, Machine, load_machine
from corexy_fmi.motion import Motion, chain, circle, line, rest
from corexy_fmi.recording import Recording, write_recording
from corexy_fmi.simulate import simulate

RATE, BLOCK, NOISE, GAP = 1000, 60.0, 2e-5, 0.02  # [Hz], [s], [m], [rad]
REACH = (0.05, 0.04)  # [m] from the centre
SPEEDS, ACCELERATION = (0.02, 0.15), 2.0  # [m/s], [m/s^2]
PLANTED = EffectUse("backlash", "motor1", {"gap": GAP})
ASIDE = {"carriage_mass": 1.1, "belt_axial_stiffness": 0.9, "carriage_viscous_friction": 1.15}
COMMAND = "python -m benchmarks.hour"


def plant() -> Machine:
    """The machine behind the recordings."""
    nominal = load_machine("yin2018")
    numbers = {n: v * ASIDE.get(n, 1.0) for n, v in nominal.parameters.items()}
    return replace(nominal, parameters=numbers, effects=(PLANTED,))


def block(random: np.random.Generator) -> Motion:
    """A minute of work: straight moves to drawn places, pauses, a circle; from centre to centre."""
    here, moves, left = (0.0, 0.0), [rest((0, 0), 0.5)], BLOCK - 3.0
    while left > 12.0:
        there = (float(random.uniform(-1, 1) * REACH[0]), float(random.uniform(-1, 1) * REACH[1]))
        moves.append(line(here, there, float(random.uniform(*SPEEDS)), ACCELERATION))
        if random.random() < 0.2:
            moves.append(rest(there, 0.4))
        here, left = there, left - moves[-1].duration - moves[-2].duration
    moves += [line(here, (0.01, 0), 0.1, ACCELERATION), circle(0.01, 0.05, 2, ACCELERATION)]
    done = chain(*moves, line((0.01, 0), (0, 0), 0.05, ACCELERATION))
    return chain(done, rest((0, 0), max(BLOCK - done.duration, 0.0)))


def recording(minutes: int, seed: int = 1) -> Recording:
    """So many minutes of the plant at 1 kHz."""
    random, truth = np.random.default_rng(seed), plant()
    within = np.arange(int(BLOCK * RATE)) / RATE
    path = np.concatenate([block(random).position(within) for _ in range(minutes)])
    radius = truth.parameters["pulley_radius"]
    angles = {"phi1": path.sum(axis=1) / radius, "phi2": (path[:, 0] - path[:, 1]) / radius}
    order = Recording("run.csv", np.arange(len(path)) / RATE, angles)
    response = simulate(truth, order)
    seen = {n: response[n] + NOISE * random.normal(size=len(order)) for n in ("x", "y")}
    return replace(order, channels={**order.channels, **seen})


def measured(minutes: int) -> dict[str, Any]:
    """Wall clock, peak memory and outcome of ``corexy diagnose`` on so many minutes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = recording(minutes)
        write_recording(made, folder / "run.csv")
        rows, load = len(made), os.getloadavg()[0]
        del made
        words = ["diagnose", "run.csv", "--machine", "yin2018", "--out", "result"]
        begin = clock.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "corexy_fmi", *words], cwd=folder, stdout=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(process.pid, 0)
        seconds = clock.perf_counter() - begin
        if status:
            raise SystemExit(f"the diagnosis left with status {status}")
        result = folder / "result"
        document = json.loads((result / "diagnosis.json").read_text(encoding="utf-8"))
        report = (result / "report.html").stat().st_size
    return {
        "minutes": minutes,
        "rows": rows,
        "seconds": seconds,
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "peak_gib": usage.ru_maxrss / 2**20,
        "report_mb": report / 1e6,
        "load_average_before": load,
        "verdict": document["verdict"],
        "effects": [
            {"name": e["name"], "location": e["location"], "parameters": e["parameters"]}
            for e in document["effects"]
        ],
        "heldout": document["heldout"],
    }


def main() -> None:
    """Measure each length; what is asked for replaces the row of its length."""
    path = RESULTS / "hour.json"
    held = json.loads(path.read_text(encoding="utf-8"))["rows"] if path.exists() else []
    rows = {row["minutes"]: row for row in held}
    for minutes in [int(word) for word in sys.argv[1:]] or [60]:
        rows[minutes] = measured(minutes)
        print(json.dumps(rows[minutes], indent=1), flush=True)
        about = {**processor(), "machine": "yin2018 (surrogate)", "planted": f"gap {GAP} rad"}
        table = [rows[n] for n in sorted(rows)]
        write_outcome("hour", COMMAND, about | {"rows": table})


if __name__ == "__main__":
    main()
