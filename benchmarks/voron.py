"""What a diagnosis makes of two real recordings of a toolhead's acceleration.

    python -m benchmarks.voron [FOLDER | --render]

imports both moves; says from the machine file alone what they can decide; fits the first 0.45 s of
both, judges the rest, in which the stop lies; fits each move alone, for what both share, the belts.
Writes benchmarks/results/voron.json and docs/cases/voron.md.  FOLDER holds the recordings (default:
../shared/data/voron_ringdown beside the checkout); nobody may redistribute them.  --render writes
the page anew from the stored numbers.
"""

from __future__ import annotations

import json
import shlex
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.case import PAGES, ROOT, corexy, kept
from benchmarks.outcome import RESULTS, write_outcome
from benchmarks.voron_page import rendered
from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.data.wiring import fitted, predicted
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.screen import bounds
from corexy_fmi.engine.telling.document import not_excluded
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.simulate import simulate

DATA = ROOT.parent / "shared" / "data" / "voron_ringdown"
MACHINE = "voron2_250"
MOVES = {
    "x.csv": ("4_x_stock__adxl345-20200810_214044.csv", "0.100,0.125:0.150,0.125"),
    "y.csv": ("5_y_stock__adxl345-20200810_214047.csv", "0.125,0.100:0.125,0.150"),
}
CUT = 0.45  # [s] fitted before, judged after: the move stops at 0.52 s
REST = 0.25  # [s] at the end, in which the floor is read
CRUISE = (0.3, 0.5)  # [s] constant speed, the start of the move long decayed
PAGE = PAGES / "voron.md"
SEED = 1  # of the noise of the imagined recordings


def import_words(name: str) -> list[str]:
    """The words that import one move."""
    source, move = MOVES[name]
    return ["import", "klipper", source, "--move", move, "--centre", "0.125,0.125",
            "--speed", "0.1", "--accel", "6", "--start-offset", "-0.0008", "--axes=-z,+y",
            "--machine", MACHINE, "--out", name]  # fmt: skip


def bring_in(data: Path, folder: Path) -> None:
    """Import both moves into a folder, and part each into what is fitted and what is judged."""
    for name, (source, _) in MOVES.items():
        words = import_words(name)
        words[words.index(source)] = str(data / source)
        corexy(folder, *words)
        for part, recording in parts(read_recording(folder / name)).items():
            write_recording(recording, folder / part)


def parts(recording: Recording) -> dict[str, Recording]:
    """Up to `CUT`, and the whole run with its samples blank up to there."""
    stem, early = recording.name.removesuffix(".csv"), recording.time <= CUT
    first = {n: v[early] for n, v in recording.channels.items()}
    rest = {
        n: np.where(early, np.nan, v) if n in recording.measured else v
        for n, v in recording.channels.items()
    }
    return {
        f"{stem}_fit.csv": replace(
            recording, name=f"{stem}_fit.csv", time=recording.time[early], channels=first
        ),
        f"{stem}_rest.csv": replace(recording, name=f"{stem}_rest.csv", channels=rest),
    }


def diagnose_words(*names: str) -> list[str]:
    """The words of a diagnosis of the first parts, judged on the rests."""
    stems = [name.removesuffix(".csv") for name in names]
    held = [word for s in stems for word in ("--holdout", f"{s}_rest.csv")]
    return ["diagnose", *(f"{s}_fit.csv" for s in stems), *held, "--machine", MACHINE,
            "--jobs", "1", "--json", "--out", "found"]  # fmt: skip


def floors(recording: Recording) -> dict[str, float]:
    """Standard deviation of each channel at rest, at the end [m/s^2]."""
    late = recording.time > recording.time[-1] - REST
    return {n: float(np.nanstd(recording[n][late])) for n in recording.measured}


def hum(recording: Recording) -> dict[str, list[float]]:
    """Standard deviation [m/s^2] and strongest frequency [Hz] of each channel at constant speed."""
    result = {}
    for channel in recording.measured:
        here = (recording.time > CRUISE[0]) & (recording.time < CRUISE[1])
        here &= np.isfinite(recording[channel])
        time, values = recording.time[here], recording[channel][here]
        size = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values))))
        strongest = int(np.argmax(size)) * (len(values) - 1) / len(values) / float(np.ptp(time))
        result[channel] = [float(values.std()), strongest]
    return result


def crosstalk(recording: Recording) -> dict[str, float]:
    """How much of the move each channel shows, in parts of it."""
    machine = load_machine(MACHINE)
    response = predicted(recording, machine)
    found = fitted(recording, response, ("ax", "ay")) if response else None
    return dict(zip(("ax", "ay"), found.response[:, 0].tolist(), strict=True)) if found else {}


def foretold(recordings: list[Recording], noise: list[dict[str, float]]) -> list[dict[str, Any]]:
    """`not_excluded` before any fit: the moves run by the machine file, with noise [m/s^2].

    Nothing is missing there, so that what cannot be excluded is what these moves cannot show.
    """
    machine, random = load_machine(MACHINE), np.random.default_rng(SEED)
    imagined = []
    for recording, floor in zip(recordings, noise, strict=True):
        response = simulate(machine, recording)
        seen = {
            n: np.where(
                np.isfinite(recording[n]),
                response[n] + random.normal(0, floor[n], len(recording)),
                np.nan,
            )
            for n in recording.measured
        }
        imagined.append(replace(recording, channels=dict(recording.channels) | seen))
    layout = bundled_layout()
    runs, _ = make_runs(imagined, imagined, machine)
    base = retune(layout, machine, tuple(runs))
    leads = bounds(base, instances(layout, machine))
    return not_excluded(leads, set())


def measure(data: Path) -> dict[str, Any]:
    """Import, foretell, diagnose, and read the floor."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bring_in(data, folder)
        recordings = {n: read_recording(folder / n) for n in MOVES}
        early = [read_recording(folder / f"{n.removesuffix('.csv')}_fit.csv") for n in MOVES]
        before = foretold(early, [floors(r) for r in recordings.values()])
        told = {
            key: kept(json.loads(corexy(folder, *diagnose_words(*names))))
            for key, names in (("both", tuple(MOVES)), *((n, (n,)) for n in MOVES))
        }
    return {
        "machine": MACHINE,
        "cut": CUT,
        "import": [shlex.join(["corexy", *import_words(n)]) for n in MOVES],
        "diagnose": shlex.join(["corexy", *diagnose_words(*MOVES)]),
        "floor": {n: floors(r) for n, r in recordings.items()},
        "hum": {n: hum(r) for n, r in recordings.items()},
        "crosstalk": {n: crosstalk(r) for n, r in recordings.items()},
        "foretold": before,
        "runs": told,
    }


def main() -> None:
    """Measure, write and render."""
    path, data = RESULTS / "voron.json", Path(sys.argv[1]) if len(sys.argv) > 1 else DATA
    if str(data) != "--render":
        if not data.is_dir():
            sys.exit(f"{data}: no such folder, expected the recordings of a Voron's ring-down")
        path = write_outcome("voron", "python -m benchmarks.voron", measure(data))
    PAGE.write_text(rendered(json.loads(path.read_text(encoding="utf-8"))), encoding="utf-8")
    print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
