"""Two carts on a spring, recorded by others: fitted on square waves, judged on sines.

    python -m benchmarks.flexdrive [FOLDER | --suspects | --render]

imports seven recordings of a teaching rig, diagnoses the two square waves with the five sines held
out, and writes benchmarks/results/flexdrive.json and docs/cases/flexdrive.md.  FOLDER holds the
recordings (default: ../shared/data/flexdrive beside the checkout); nobody may redistribute them.
--suspects measures only what suspected causes would take away, when forced in; --render writes the
page anew from the stored numbers.
"""

from __future__ import annotations

import json
import shlex
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.case import PAGES, ROOT, corexy, kept
from benchmarks.flexdrive_page import rendered
from benchmarks.flexdrive_suspects import suspects
from benchmarks.outcome import RESULTS, commit, write_outcome
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import Recording, read_recording

DATA = ROOT.parent / "shared" / "data" / "flexdrive"
PAGE = PAGES / "flexdrive.md"
FILE = "lab3_velocity_response_{}.mat"
SQUARES = ("1_5", "2")
SINES = ("sine_1", "sine_2", "sine_3", "sine_5", "sine_8")
MAPS = ("time=t", "V1=u", "vx=v1[mm/s]", "vy=v2[mm/s]")
MACHINE = "flexdrive"
QUANTUM = 4.6592e-3  # [m/s] one count of an encoder in a millisecond
SETTLED = 0.5  # [s] after an edge of the square wave


def import_words(name: str, data: str = "") -> list[str]:
    """The words that import one recording."""
    maps = [word for entry in MAPS for word in ("--map", entry)]
    source = f"{data}{'/' if data else ''}{FILE.format(name)}"
    return ["import", "mat", source, *maps, "--about", "motors: 1", "--about", "zero: vx, vy",
            "--machine", MACHINE, "--out", f"{name}.csv"]  # fmt: skip


def diagnose_words() -> list[str]:
    """The words of the diagnosis."""
    held = [word for name in SINES for word in ("--holdout", f"{name}.csv")]
    files = [f"{name}.csv" for name in SQUARES]
    return ["diagnose", *files, *held, "--machine", MACHINE, "--jobs", "1", "--json",
            "--out", "found"]  # fmt: skip


def by_direction(recording: Recording) -> dict[str, list[float]]:
    """Steady speed [m/s] of both carts under positive and under negative voltage."""
    volts, time = recording["V1"], recording.time
    edges = np.concatenate([[0.0], time[1:][np.diff(np.sign(volts)) != 0]])
    since = time - edges[np.searchsorted(edges, time, side="right") - 1]
    found = {}
    for sign, name in ((1, "forward"), (-1, "backward")):
        here = (np.sign(volts) == sign) & (since > SETTLED)
        found[name] = [float(recording[c][here].mean()) for c in ("vx", "vy")]
    return found


def measure(data: Path) -> dict[str, Any]:
    """Import, read steady speeds, diagnose."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for each in (*SQUARES, *SINES):
            corexy(folder, *import_words(each, str(data)))
        steady = {n: by_direction(read_recording(folder / f"{n}.csv")) for n in SQUARES}
        run = kept(json.loads(corexy(folder, *diagnose_words())))
    words = [import_words(SQUARES[0]), diagnose_words()]
    return {
        "commands": [shlex.join(["corexy", *each]) for each in words],
        "quantum": QUANTUM,
        "steady": steady,
        "run": run,
    }


def forced(data: Path) -> dict[str, Any]:
    """Suspected causes forced in, and the commit that did it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for each in (*SQUARES, *SINES):
            corexy(folder, *import_words(each, str(data)))
        train, held = ([read_recording(folder / f"{n}.csv") for n in g] for g in (SQUARES, SINES))
    return {"commit": commit(), "found": suspects(train, held, load_machine(MACHINE))}


def main() -> None:
    """Measure, write and render."""
    word = sys.argv[1] if len(sys.argv) > 1 else ""
    path, data = RESULTS / "flexdrive.json", Path(word) if word and word[0] != "-" else DATA
    stored = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    if word != "--render":
        if not data.is_dir():
            sys.exit(f"{data}: no such folder, expected the recordings of flexdrive")
        if word == "--suspects":
            text = json.dumps(stored | {"suspects": forced(data)}, indent=1) + "\n"
            path.write_text(text, encoding="utf-8")
        else:
            result = measure(data) | {"suspects": forced(data)}
            write_outcome("flexdrive", "python -m benchmarks.flexdrive", result)
    PAGE.write_text(rendered(json.loads(path.read_text(encoding="utf-8"))), encoding="utf-8")
    print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
