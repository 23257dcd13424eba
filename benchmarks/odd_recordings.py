"""Odd recordings through `corexy diagnose`: none may end in a traceback or a warning of NumPy's.

    python -m benchmarks.odd_recordings [--first 0] [--count 200]

Short runs of random machines, their channels still, blank, huge, rounded, inverted, adrift or
silent from some time on, rows lost and stamps astray.  Whatever such files say, the command ends
with a verdict (0) or one line (2).  Writes benchmarks/results/odd_recordings.json.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.concealed.proof import commit
from corexy_fmi import cli
from corexy_fmi.machine import Machine, load_machine, save_machine
from corexy_fmi.motion import Motion, chain, circle, command, line, rest
from corexy_fmi.recording import Recording, write_recording
from corexy_fmi.simulate import simulate

RESULT = Path(__file__).parent / "results" / "odd_recordings.json"
Array = NDArray[np.float64]
MACHINES = {  # name: fidelities
    "yin2018": ("full", "reduced", "kinematic"),
    "light_bench": ("full", "reduced", "kinematic"),
    "gt2_printer": ("full", "reduced"),
    "voron2_250": ("reduced", "kinematic"),
    "yin2018_dc": ("full", "reduced"),
}
RATES = (1000.0, 1000.0, 200.0, 50.0)
CHANNELS = ("x y", "x y", "x", "y", "ax ay", "vx vy", "x y ax ay", "x y phi1_meas phi2_meas")
NOISES = (0.0, 1e-6, 1e-5, 1e-4, 1e-3)
KERNEL = {"phi1_meas": "phi1", "phi2_meas": "phi2"}
MOTIONS: tuple[tuple[tuple[float, float, float], ...], ...] = (  # x, y, speed of each leg
    ((0.02, 0.0, 0.1), (0.02, 0.015, 0.05), (0.0, 0.0, 0.08)),
    ((0.02, 0.0, 0.02), (0.0, 0.0, 0.05)),
    ((0.001, 0.001, 0.002),),
    ((1e-4, 0.0, 0.05),),
    (),
)


def _motion(random: np.random.Generator) -> Motion:
    if random.random() < 0.2:
        return chain(rest((0, 0), 0.05), circle(0.01, 0.06, 1, 2.0, (-0.01, 0)), rest((0, 0), 0.1))
    moves, here = [rest((0.0, 0.0), float(random.choice((0.003, 0.05, 0.4))))], (0.0, 0.0)
    for x, y, speed in MOTIONS[random.integers(len(MOTIONS))]:
        moves.append(line(here, (x, y), speed, 2.0))
        here = (x, y)
    return chain(*moves, rest(here, 0.1))


def _every(v: Array, random: np.random.Generator) -> Array:
    return np.where(np.arange(len(v)) % random.choice((2, 10, 40, 300)) == 0, v, np.nan)


def _silent(v: Array, random: np.random.Generator) -> Array:
    first, last = sorted(random.random(2))
    share = np.linspace(0, 1, len(v))
    return np.where((share > first) & (share < last), np.nan, v)


def _spiked(v: Array, random: np.random.Generator) -> Array:
    return v + 1e6 * (np.arange(len(v)) == random.integers(len(v)))


SPOILT: tuple[Callable[[Array, np.random.Generator], Array], ...] = (
    *[lambda v, random: v] * 6,
    _every,
    _silent,
    _spiked,
    lambda v, random: np.full_like(v, v[0]),
    lambda v, random: np.full_like(v, np.nan),
    lambda v, random: 1e9 * v,
    lambda v, random: 1e3 * v,
    lambda v, random: -v,
    lambda v, random: np.round(v, 4),
    lambda v, random: v + np.linspace(0, 1, len(v)) ** 2,
)


def _recording(name: str, machine: Machine, random: np.random.Generator) -> Recording:
    rate = RATES[random.integers(len(RATES))]
    order = command(_motion(random), machine.parameters["pulley_radius"], rate, name)
    about = {k: v for k, v in (("clock", "free"), ("zero", "x, y")) if random.random() < 0.1}
    if machine.controller is not None:
        about["controller"] = machine.controller.line
    order = replace(order, metadata=about)
    response, channels = simulate(machine, order), dict(order.channels)
    for channel in str(random.choice(CHANNELS)).split():
        noise = random.choice(NOISES) * random.normal(size=len(order))
        spoil = SPOILT[random.integers(len(SPOILT))]
        channels[channel] = spoil(response[KERNEL.get(channel, channel)] + noise, random)
    if machine.drive == "dc":
        channels |= {n: response[n] for n in ("V1", "V2") if random.random() < 0.8}
    return _astray(replace(order, channels=channels), random)


def _astray(recording: Recording, random: np.random.Generator) -> Recording:
    """Rows lost, stamps that scatter or begin elsewhere."""
    time, channels = recording.time, recording.channels
    if random.random() < 0.15:
        time = np.sort(time + random.uniform(-2e-4, 2e-4, len(time)))
    if random.random() < 0.1:
        time = time + random.choice((1e5, -50.0))
    if random.random() < 0.1:
        kept = (random.random(len(time)) > 0.1) | (np.arange(len(time)) == 0)
        time, channels = time[kept], {n: v[kept] for n, v in channels.items()}
    return replace(recording, time=time, channels=channels)


def words(seed: int, folder: Path) -> list[str]:
    """The command line of a case; its files lie in the folder."""
    random = np.random.default_rng(seed)
    name = str(random.choice(list(MACHINES)))
    machine = replace(load_machine(name), fidelity=str(random.choice(MACHINES[name])))
    save_machine(machine, folder / "machine.toml")
    files = [f"{n}.csv" for n in range(random.integers(1, 4))]
    for file in files:
        write_recording(_recording(file, machine, random), folder / file)
    judges = files[-1:] if len(files) > 1 and random.random() < 0.3 else []
    fitted = [str(folder / f) for f in files if f not in judges]
    judged = [w for f in judges for w in ("--holdout", str(folder / f))]
    end = ["--machine", str(folder / "machine.toml"), "--out", str(folder / "out"), "--jobs", "1"]
    return ["diagnose", *fitted, *judged, *end]


def outcome(seed: int) -> tuple[str, str]:
    """What a case came to (a verdict, "refused", "broke down" or "warned"), and in what words."""
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as place, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        folder, given = Path(place), sys.argv
        sys.argv = ["corexy", *words(seed, folder)]
        try:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
                status = cli.run()
        except Exception:
            return "broke down", traceback.format_exc().strip().splitlines()[-1]
        finally:
            sys.argv = given
        lines = said.getvalue().strip().splitlines()
        if warned:
            return "warned", str(warned[0].message)
        if status == 2 and len(lines) == 1:
            return "refused", lines[0].replace(f"{place}/", "")
        if status != 0:
            return "broke down", f"status {status}: {' / '.join(lines)}"
        return json.loads((folder / "out" / "diagnosis.json").read_text())["verdict"], ""


def main() -> None:
    """Run, print what went wrong, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    given, counts, wrong = parser.parse_args(), Counter[str](), dict[int, str]()
    for seed in track(range(given.first, given.first + given.count), description="odd recordings"):
        word, told = outcome(seed)
        counts[word] += 1
        if word in ("broke down", "warned"):
            wrong[seed] = told
            print(f"{seed}: {word}: {told}", flush=True)
    found: dict[str, Any] = {"commit": commit(), "first": given.first, "count": given.count}
    RESULT.write_text(json.dumps(found | {"outcomes": counts, "wrong": wrong}, indent=1) + "\n")


if __name__ == "__main__":
    main()
