"""One blind case on one screen: ``make blind SEED=n`` (`python -m benchmarks.concealed.blind`).

The plant draws a case and seals its truth by hash; the engine, which never sees the truth, gives
its verdict; the seal is opened.  Beside it the controls on the same motion: the twin with the
effect off, a wrong effect forced in, and the true entry struck from the catalogue.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import plant
from rich.console import Console
from rich.table import Table

from benchmarks.concealed.score import fulfilled, score
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.force import force
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.recording import Recording, read_recording

JOBS, ABREAST = 2, 2  # workers of a diagnosis; diagnoses at once, for none keeps two cores busy
Given = tuple[list[Recording], list[Recording], Machine]  # to fit, to judge on, its file
WRONG = (("stribeck_friction", "y"), ("belt_mismatch", "belts"), ("axis_skew", "sensor"))


def load(case: Any) -> Given:
    """What a user would have: recordings and a machine file, read from disk; not the truth."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant.write(case, folder)
        train = [read_recording(folder / n) for n in sorted(case.train)]
        holdout = [read_recording(folder / n) for n in sorted(case.holdout)]
        return train, holdout, load_machine(folder / "machine.toml")


def verdict(given: Given, without: frozenset[str] = frozenset()) -> dict[str, Any]:
    """The document of a diagnosis."""
    return diagnose(*given, jobs=JOBS, without=without).document


def _deaf() -> None:
    """An interrupt is the parent's to hear, which ends its children."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _named(document: dict[str, Any]) -> str:
    names = " + ".join(
        f"{e['name']} at {e['location']} (p {e['probability']:.3f})" for e in document["effects"]
    )
    return f"{document['verdict']}{': ' + names if names else ''}"


def _microns(value: float | None) -> str:
    return "-" if value is None else f"{1e6 * value:.2f}"


def _row(table: Table, label: str, held: dict[str, Any], text: str) -> None:
    keys = ("rms_nominal", "rms_retuned", "rms_explained", "noise_std")
    table.add_row(label, *[_microns(held[k]) for k in keys], text)


def _wrong_effect(truth: dict[str, Any]) -> tuple[str, str]:
    names = {e["name"] for e in truth["effects"]}
    return next(pair for pair in WRONG if pair[0] not in names)


def controls(case: Any, given: Given, pool: Any) -> list[tuple[str, Any]]:
    """Names of the controls' rows, and what will give their held-out rms and words; the longest
    begins first.
    """
    truth, rows = case.truth, []
    if truth["effects"]:
        planted = frozenset(e["name"] for e in truth["effects"])
        struck = pool.apply_async(_told, (given, planted))
        twin = pool.apply_async(_told, (load(plant.twin(case)),))
        rows = [("the twin, effect off", twin), ("true entry deleted", struck)]
    forced = pool.apply_async(_forced, (given, *_wrong_effect(truth)))
    return [("a wrong effect forced in", forced), *rows]


def _told(given: Given, without: frozenset[str] = frozenset()) -> tuple[dict[str, Any], str]:
    document = verdict(given, without)
    return document["heldout"], _named(document)


def _forced(given: Given, name: str, location: str) -> tuple[dict[str, Any], str]:
    return force(*given, name, location), f"{name} at {location}"


def _truth_text(truth: dict[str, Any]) -> str:
    parts = [
        f"{e['name']} at {e['location']} {json.dumps(e['parameters'])}" for e in truth["effects"]
    ]
    return " + ".join(parts) or truth["kind"]


def main() -> None:
    """Run one case and print one screen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument(
        "--catalogue", choices=("ten", "full"), default="full", help="what the plant draws from"
    )
    parser.add_argument("--no-controls", action="store_true", help="only the blind case itself")
    arguments = parser.parse_args()
    console, begun = Console(width=132), time.monotonic()
    with console.status("the plant draws a case (in a fresh clone it compiles first)"):
        case = plant.draw(arguments.seed, catalogue=arguments.catalogue)
        seal, sealed = plant.seal(case)
    console.print(f"seed {arguments.seed}   seal sha256 {seal}")
    table = Table("held-out rms [um]", "given", "retuned", "explained", "noise", "verdict")
    given, processes = load(case), multiprocessing.get_context("spawn")
    with processes.Pool(ABREAST, _deaf) as pool:  # its end ends its processes
        blind = pool.apply_async(verdict, (given,))
        beside = [] if arguments.no_controls else controls(case, given, pool)
        with console.status("the engine diagnoses, blind"):
            document = blind.get()
        _row(table, "the blind case", document["heldout"], _named(document))
        with console.status("controls on the same motion"):
            for label, found in beside:
                _row(table, label, *found.get())
    console.print(table)
    truth = case.truth
    opened = hashlib.sha256(sealed).hexdigest() == seal
    outcome = score(document, truth)
    asked = "" if fulfilled(outcome, truth) else " (not what was asked)"
    console.print(f"seal opened, hash {'matches' if opened else 'DOES NOT MATCH'}")
    console.print(
        f"truth: {_truth_text(truth)}   E {truth['E']:.4g}, E_sep {truth['E_sep']:.4g}, "
        f"setting {truth['setting']}"
    )
    console.print(f"outcome: {outcome}{asked}   {time.monotonic() - begun:.0f} s")
    sys.exit(0 if opened else 1)


if __name__ == "__main__":
    main()
