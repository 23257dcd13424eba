"""What a diagnosis makes of two real recordings of a toolhead's acceleration.

    python -m benchmarks.voron [FOLDER]

imports both moves, diagnoses them together and alone, and writes benchmarks/results/voron.json and
the tables of docs/voron.md.  FOLDER holds the recordings (default: ../shared/data/voron_ringdown
beside the checkout); nobody may redistribute them.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.outcome import write_outcome
from corexy_fmi.engine.wiring import fitted, predicted
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import Recording, read_recording

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data" / "voron_ringdown"
MACHINE = "voron2_250"
MOVES = {
    "x.csv": ("4_x_stock__adxl345-20200810_214044.csv", "0.100,0.125:0.150,0.125"),
    "y.csv": ("5_y_stock__adxl345-20200810_214047.csv", "0.125,0.100:0.125,0.150"),
}
RUNS = {"both": ("x.csv", "y.csv"), "x.csv": ("x.csv",), "y.csv": ("y.csv",)}
REST = 0.25  # [s] at the end, in which the floor is read
CRUISE = (0.3, 0.5)  # [s] constant speed, the start of the move long decayed
DOCUMENT = ROOT / "docs" / "voron.md"
BEGIN, END = "<!-- voron: begin -->", "<!-- voron: end -->"


def corexy(folder: Path, *words: str) -> str:
    """What a command prints."""
    command = [sys.executable, "-m", "corexy_fmi", *words]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def import_words(name: str) -> list[str]:
    """The words that import one move."""
    source, move = MOVES[name]
    return ["import", "klipper", source, "--move", move, "--centre", "0.125,0.125",
            "--speed", "0.1", "--accel", "6", "--start-offset", "-0.0008", "--axes=-z,+y",
            "--machine", MACHINE, "--out", name]  # fmt: skip


def bring_in(data: Path, folder: Path) -> None:
    """Import both moves into a folder."""
    for name, (source, _) in MOVES.items():
        words = import_words(name)
        words[words.index(source)] = str(data / source)
        corexy(folder, *words)


def diagnose_words(names: tuple[str, ...]) -> list[str]:
    """The words of one diagnosis."""
    return ["diagnose", *names, "--machine", MACHINE, "--jobs", "2", "--json", "--out", "found"]


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


def summary(document: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of a diagnosis."""
    effects = [{k: e.get(k) for k in ("name", "location", "probability", "description")}
               for e in document["effects"]]  # fmt: skip
    kept = ("verdict", "ambiguous_between", "fit", "heldout", "retuned", "seconds")
    return {k: document[k] for k in kept} | {"effects": effects}


def measure(data: Path) -> dict[str, Any]:
    """Import, diagnose, and read the floor."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bring_in(data, folder)
        recordings = {n: read_recording(folder / n) for n in MOVES}
        told = {
            key: summary(json.loads(corexy(folder, *diagnose_words(names))))
            for key, names in RUNS.items()
        }
    return {
        "machine": MACHINE,
        "import": [" ".join(["corexy", *import_words(n)]) for n in MOVES],
        "diagnose": " ".join(["corexy", *diagnose_words(RUNS["both"])]),
        "floor": {n: floors(r) for n, r in recordings.items()},
        "hum": {n: hum(r) for n, r in recordings.items()},
        "crosstalk": {n: crosstalk(r) for n, r in recordings.items()},
        "runs": told,
    }


def _lines(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *rows])


def distances(document: dict[str, Any]) -> str:
    """How far each channel is from its floor."""
    rows = []
    for row in document["runs"]["both"]["fit"]:
        if row["role"] == "train":
            floor = document["floor"][row["recording"]][row["channel"]]
            sizes = [row[f"rms_{state}"] for state in ("nominal", "retuned", "explained")]
            rows.append([row["recording"], row["channel"], *(f"{v:.3f}" for v in (floor, *sizes)),
                         f"{sizes[-1] / floor:.1f}"])  # fmt: skip
    head = ["recording", "channel", "at rest", "as given", "retuned", "explained", "over rest"]
    return _lines(head, rows)


def verdicts(document: dict[str, Any]) -> str:
    """What each diagnosis says."""
    rows = []
    for key, run in document["runs"].items():
        causes = ", ".join(f"{e['name']} at {e['location']}" for e in run["effects"]) or "none"
        held = run["heldout"]
        rows.append([key, run["verdict"], causes, f"{held['rms_explained']:.3f}",
                     f"{held['noise_std']:.3f}", f"{run['seconds']:.0f}"])  # fmt: skip
    head = ["recordings", "verdict", "cause", "held-out rms", "noise assumed", "seconds"]
    return _lines(head, rows)


def numbers(document: dict[str, Any]) -> str:
    """The retuned parameters."""
    rows = []
    for name, entry in document["runs"]["both"]["retuned"].items():
        low, high = entry["ci95"]
        told = "its prior" if entry["prior_driven"] else "the data"
        rows.append([name, f"{entry['value']:.4g} {entry['unit']}", f"{low:.3g} .. {high:.3g}",
                     f"{entry['pull']:+.1f}", told])  # fmt: skip
    return _lines(["parameter", "value", "95 %", "pull", "decided by"], rows)


def turn(document: dict[str, Any]) -> str:
    """The sentence on the sensor's mounting."""
    along, across = document["crosstalk"]["x.csv"], document["crosstalk"]["y.csv"]
    angle = np.degrees((along["ay"] / along["ax"] - across["ax"] / across["ay"]) / 2)
    return (
        f"During the move along x, ay shows {100 * along['ay']:+.1f} % of it; during that along "
        f"y, ax shows {100 * across['ax']:+.1f} %. Equal sizes and opposite signs are those of a "
        f"sensor turned by {abs(angle):.1f} degrees."
    )


def humming(document: dict[str, Any]) -> str:
    """What the sensor feels at constant speed, where the model is still."""
    rows = [
        [name, channel, f"{document['floor'][name][channel]:.3f}", f"{size:.3f}", f"{peak:.0f} Hz"]
        for name, channels in document["hum"].items()
        for channel, (size, peak) in channels.items()
    ]
    return _lines(["recording", "channel", "at rest", "at constant speed", "strongest at"], rows)


def page(document: dict[str, Any]) -> str:
    """The measured part of docs/voron.md."""
    source = f"`{document['command']}` at commit {document['commit'][:12]}"
    commands = "\n".join([*document["import"], document["diagnose"]])
    return "\n\n".join([
        f"```\n{commands}\n```",
        f"Measured by {source}. Accelerations, rms in m/s^2, of the first 70 % of each recording "
        f"(at rest: the last {REST:g} s):",
        distances(document),
        "What is said of both recordings together, and of each alone; held out is the last 30 %:",
        verdicts(document),
        turn(document),
        f"At constant speed, {CRUISE[0]:g} s to {CRUISE[1]:g} s after the start of the move, where "
        "the model moves evenly:",
        humming(document),
        "Retuned numbers of the diagnosis of both:",
        numbers(document),
    ])  # fmt: skip


def render(document: dict[str, Any]) -> None:
    """Put the measured part between its marks."""
    before, rest = DOCUMENT.read_text(encoding="utf-8").split(BEGIN)
    text = f"{before}{BEGIN}\n{page(document)}\n{END}{rest.split(END)[1]}"
    DOCUMENT.write_text(text, encoding="utf-8")


def main() -> None:
    """Measure, write and render."""
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else DATA
    if not data.is_dir():
        sys.exit(f"{data}: no such folder, expected the recordings of a Voron's ring-down")
    path = write_outcome("voron", "python -m benchmarks.voron", measure(data))
    render(json.loads(path.read_text(encoding="utf-8")))
    print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
