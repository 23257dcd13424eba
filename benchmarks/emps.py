"""A force that others hid in a real machine: EMPS with its pulses, and its friction.

    python -m benchmarks.emps [FOLDER | --render]

imports both recordings, diagnoses the untouched one in closed loop, then, with the machine fitted
to it, the one with pulses; compares with the pulses that were logged and kept from the program, and
writes benchmarks/results/emps.json, docs/cases/emps.md and its figures.  FOLDER holds DATA_EMPS.mat
and DATA_EMPS_PULSES.mat (default: ../shared/data/emps beside the checkout); they stay there.
--render writes the page anew from the stored numbers.
"""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from benchmarks.emps_page import draw, rendered
from benchmarks.outcome import RESULTS, write_outcome
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import EffectUse, Machine, load_machine, save_machine
from corexy_fmi.recording import Recording, read_recording
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.simulate import simulate

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data" / "emps"
PAGE, IMAGES = ROOT / "docs" / "cases" / "emps.md", ROOT / "docs" / "images" / "cases"
NAMES = ("DATA_EMPS", "DATA_EMPS_PULSES")
CLOSED = ["time=t", "phi1=qg[m]", "x=qm"]
OPEN = ["time=t", "V1=vir", "x=qm"]
ABOUT = {
    "controller": "pd kp=38995.821 kd=243.45 rate_weight=0",
    "motors": "1",
    "zero": "x",
}
PUBLISHED = {"moving_mass": 95.11, "viscous_friction": 203.5, "coulomb_friction": 20.39}
OFFSET = 3.16  # [N] on the stage
LOGGED_SHARE = 1.01  # of pulses_N [V] is in vir, beside what the loop's law gives


def import_words(name: str) -> list[str]:
    """The words that import one recording."""
    maps = [word for entry in CLOSED for word in ("--map", entry)]
    about = [word for key, value in ABOUT.items() for word in ("--about", f"{key}: {value}")]
    return ["import", "mat", f"{name}.mat", *maps, *about, "--machine", "emps"]


def diagnose_words(name: str) -> list[str]:
    """The words of one diagnosis; that of the pulses begins with the machine fitted before."""
    machine = "emps" if name == NAMES[0] else "fitted.toml"
    return ["diagnose", f"{name}.csv", "--machine", machine, "--jobs", "1", "--json"]


def commands(name: str) -> list[str]:
    """Both commands as a user would type them."""
    words = ([*import_words(name), "--out", f"{name}.csv"], [*diagnose_words(name), "--out", name])
    return [shlex.join(["corexy", *each]) for each in words]


def corexy(folder: Path, *words: str) -> str:
    """What a command prints."""
    command = [sys.executable, "-m", "corexy_fmi", *words]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def diagnosed(data: Path, folder: Path, name: str) -> dict[str, Any]:
    """Import and diagnose one recording through the command line."""
    words = import_words(name)
    words[words.index(f"{name}.mat")] = str(data / f"{name}.mat")
    corexy(folder, *words, "--out", f"{name}.csv")
    document = json.loads(corexy(folder, *diagnose_words(name), "--out", name))
    kept = ("verdict", "effects", "nearest", "fit", "heldout", "retuned", "located", "seconds")
    return {key: document[key] for key in kept}


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))


def with_numbers(numbers: Mapping[str, float], offset: float) -> Machine:
    """EMPS with these nominal numbers and a constant force [N]."""
    machine = load_machine("emps")
    uses = (EffectUse("constant_force", "x", {"force": offset}),) if offset else ()
    return replace(machine, parameters=dict(machine.parameters) | dict(numbers), effects=uses)


def replayed(closed: Recording, opened: Recording, machine: Machine) -> dict[str, float]:
    """Errors [m] of a replay from the reference and of one from the voltage, and of the force."""
    from_reference, from_voltage = simulate(machine, closed), simulate(machine, opened)
    volts = opened["V1"]
    return {
        "closed_loop": rms(closed["x"] - from_reference["x"]),
        "open_loop": rms(opened["x"] - from_voltage["x"]),
        "force": rms(volts - from_reference["V1"]) / rms(volts),
    }


def with_a_force(told: Mapping[str, Any]) -> Mapping[str, Any]:
    """The fit of a diagnosis that adds a constant force alone."""
    sets = ([e["name"] for e in n["effects"]] for n in told["nearest"])
    pairs = zip(told["nearest"], sets, strict=True)
    return next(n for n, names in pairs if names == ["constant_force"])


def fitted(told: Mapping[str, Any]) -> Machine:
    """EMPS with the numbers of that fit."""
    alone = with_a_force(told)
    numbers = {name: entry["value"] for name, entry in alone["retuned"].items()}
    return with_numbers(numbers, alone["effects"][0]["parameters"]["force"]["value"])


def friction(data: Path, told: Mapping[str, Any]) -> dict[str, Any]:
    """Published and found numbers, each replayed on the untouched recording."""
    path = data / "DATA_EMPS.mat"
    closed = import_columns(path, CLOSED, ABOUT, 1.0)
    opened = import_columns(path, OPEN, {"motors": "1"}, 1.0)
    alone = with_a_force(told)
    force = alone["effects"][0]["parameters"]["force"]
    sets = {
        "published, no offset": with_numbers(PUBLISHED, 0.0),
        "published": with_numbers(PUBLISHED, OFFSET),
        "found here": fitted(told),
    }
    errors = {name: replayed(closed, opened, machine) for name, machine in sets.items()}
    return {"constant_force": force, "retuned": alone["retuned"], "errors": errors}


def windows(on: np.ndarray, time: Array) -> list[tuple[float, float]]:
    """Begin and end [s] of every stretch that is on; an open end is the last time."""
    steps = np.diff(np.r_[0, on.astype(int), 0])
    ends = np.r_[time, time[-1]]
    pairs = zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True)
    return [(float(time[a]), float(ends[b])) for a, b in pairs]


def course(effect: Mapping[str, Any], time: Array) -> Array:
    """Force [N] of the pulses that were found."""
    values = {name.partition("@")[0]: e["value"] for name, e in effect["parameters"].items()}
    turns = values["frequency"] * time + values["phase"] / (2 * np.pi)
    return np.where(np.mod(turns, 1) < values["duty"], values["amplitude"], 0.0)


def judged(data: Path, told: Mapping[str, Any]) -> dict[str, Any]:
    """The pulses found, against those logged; empty where none were named."""
    effect = next((e for e in told["effects"] if e["name"] == "periodic_disturbance"), None)
    if effect is None:
        return {}
    table = loadmat(data / "DATA_EMPS_PULSES.mat")
    time = table["t"].ravel()
    logged = LOGGED_SHARE * float(table["gtau"].item()) * table["pulses_N"].ravel()
    found = course(effect, time)
    true, seen = windows(logged > 0, time), windows(found > 0, time)
    errors = [min(abs(a - b) for b in np.ravel(seen)) for a in np.ravel(true)]
    errors += [min(abs(a - b) for b in np.ravel(true)) for a in np.ravel(seen)]
    size = effect["parameters"]["amplitude"]["value"]
    return {
        "place": effect["location"],
        "windows_logged": len(true),
        "windows_found": len(seen),
        "edge_error_max": max(errors),
        "edge_error_median": float(np.median(errors)),
        "size_logged": float(logged.max()),
        "size_found": size,
        "size_error": abs(size / float(logged.max()) - 1),
        "waveform_error": rms(found - logged) / rms(logged),
    }


def measure(data: Path, images: Path = IMAGES) -> dict[str, Any]:
    """Import, diagnose, judge, draw."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        told = {NAMES[0]: diagnosed(data, folder, NAMES[0])}
        save_machine(fitted(told[NAMES[0]]), folder / "fitted.toml")
        told[NAMES[1]] = diagnosed(data, folder, NAMES[1])
        pulsed = read_recording(folder / "DATA_EMPS_PULSES.csv")
        explained = simulate(load_machine(folder / "DATA_EMPS_PULSES" / "machine.toml"), pulsed)
    result = judged(data, told["DATA_EMPS_PULSES"])
    if result:
        table = loadmat(data / "DATA_EMPS_PULSES.mat")
        force = LOGGED_SHARE * float(table["gtau"].item()) * table["pulses_N"].ravel()
        effect = told["DATA_EMPS_PULSES"]["effects"][0]
        draw(images, pulsed, explained, course(effect, pulsed.time), force)
    return {
        "commands": [line for n in NAMES for line in commands(n)],
        "friction": friction(data, told["DATA_EMPS"]),
        "pulses": result,
        "runs": told,
    }


def main() -> None:
    """Measure, write and render."""
    path, data = RESULTS / "emps.json", Path(sys.argv[1]) if len(sys.argv) > 1 else DATA
    if str(data) != "--render":
        if not data.is_dir():
            sys.exit(f"{data}: no such folder, expected the recordings of EMPS")
        path = write_outcome("emps", "python -m benchmarks.emps", measure(data))
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(rendered(json.loads(path.read_text(encoding="utf-8"))), encoding="utf-8")
    print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
