"""Wall clock of a whole `corexy diagnose` over the length of its recordings.

``python -m benchmarks.concealed.wall --origin COMMIT`` draws some cases of the proof, runs the
command on each as a user would, on two cores with nothing beside it, and writes
``benchmarks/results/wall.json``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import plant
from rich.progress import track

from benchmarks.case import corexy
from benchmarks.concealed.cases import published, seed_of
from benchmarks.outcome import RESULTS, commit, write_outcome
from benchmarks.speed import processor
from corexy_fmi.recording import read_recording

STORE, COMMAND = RESULTS / "wall.json", "python -m benchmarks.concealed.wall"
NAMES = (
    "null-0", "null-1", "null-2", "stribeck_friction-0", "backlash-1",
    "belt_mismatch-2", "pulley_eccentricity-0", "sensor_delay-1",
)  # fmt: skip


def timed(case: Any) -> dict[str, float]:
    """Seconds that the command takes, files read and written, and seconds recorded."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant.write(case, folder)
        train, holdout = ([str(folder / n) for n in sorted(p)] for p in (case.train, case.holdout))
        recorded = [read_recording(Path(p)).time for p in (*train, *holdout)]
        begun = time.monotonic()
        corexy(folder, "diagnose", *train, "--holdout", *holdout, "--jobs", "2",
               "--machine", "machine.toml", "--out", "out")  # fmt: skip
        seconds = time.monotonic() - begun
    return {"seconds": seconds, "recorded": float(sum(t[-1] - t[0] for t in recorded))}


def section() -> list[str]:
    """Lines of RESULTS.md."""
    if not STORE.exists():
        return []
    told = json.loads(STORE.read_text(encoding="utf-8"))
    ratios = [c["seconds"] / c["recorded"] for c in told["cases"]]
    slowest = max(told["cases"], key=lambda c: c["seconds"] / c["recorded"])
    return [
        f"A whole `corexy diagnose` with report and FMU, all 35 effects, on two cores with nothing "
        f"beside it (`{told['command']}`, {told['cpu']} with {told['vector_units'][-1]}, commit "
        f"{told['commit'][:12]}), over the length of its recordings (aim 1): median "
        f"{np.median(ratios):.2f} of {len(ratios)} cases, {sum(r <= 1 for r in ratios)} within 1; "
        f"slowest {slowest['name']}, {slowest['seconds']:.0f} s of {slowest['recorded']:.0f} s.",
        "",
    ]


def main() -> None:
    """Time the cases, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--origin", default=commit(), help="what the seeds follow from")
    origin = parser.parse_args().origin
    wishes = dict(published(3, 3, 0, "full"))
    cases = []
    for name in track(NAMES, description="diagnoses"):
        case = plant.draw(seed_of(origin, name), **wishes[name])
        cases.append({"name": name, **timed(case)})
    write_outcome(
        "wall", f"{COMMAND} --origin {origin}", {**processor(), "origin": origin, "cases": cases}
    )
    print("\n".join(section()))


if __name__ == "__main__":
    main()
