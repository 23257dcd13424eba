"""One blind case on one screen: ``make blind SEED=n`` (`python -m benchmarks.concealed.blind`).

The plant draws a case and seals its truth by hash; the engine, which never sees the truth, gives
its verdict; the seal is opened.  Beside it the controls on the same motion: the twin with the
effect off, a wrong effect forced in, and the true entry struck from the catalogue.
"""

from __future__ import annotations

import argparse
import hashlib
import json
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

JOBS = 2
WRONG = (("stribeck_friction", "y"), ("belt_mismatch", "belts"), ("axis_skew", "sensor"))


def load(case: Any) -> tuple[list[Recording], list[Recording], Machine]:
    """What a user would have: recordings and a machine file, read from disk; not the truth."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant.write(case, folder)
        train = [read_recording(folder / n) for n in sorted(case.train)]
        holdout = [read_recording(folder / n) for n in sorted(case.holdout)]
        return train, holdout, load_machine(folder / "machine.toml")


def verdict(case: Any, without: frozenset[str] = frozenset()) -> dict[str, Any]:
    """The document of a diagnosis of a case."""
    train, holdout, machine = load(case)
    return diagnose(train, holdout, machine, jobs=JOBS, without=without).document


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


def controls(case: Any, table: Table) -> None:
    """The rows of the controls."""
    truth = case.truth
    train, holdout, machine = load(case)
    name, location = _wrong_effect(truth)
    _row(
        table,
        "a wrong effect forced in",
        force(train, holdout, machine, name, location),
        f"{name} at {location}",
    )
    if truth["effects"]:
        twin = verdict(plant.twin(case))
        _row(table, "the twin, effect off", twin["heldout"], _named(twin))
        deleted = verdict(case, frozenset(e["name"] for e in truth["effects"]))
        _row(table, "true entry deleted", deleted["heldout"], _named(deleted))


def _truth_text(truth: dict[str, Any]) -> str:
    parts = [
        f"{e['name']} at {e['location']} {json.dumps(e['parameters'])}" for e in truth["effects"]
    ]
    return " + ".join(parts) or truth["kind"]


def main() -> None:
    """Run one case and print one screen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--catalogue", choices=("ten", "full"), default="ten")
    parser.add_argument("--no-controls", action="store_true", help="only the blind case itself")
    arguments = parser.parse_args()
    console, begun = Console(width=132), time.monotonic()
    with console.status("the plant draws a case"):
        case = plant.draw(arguments.seed, catalogue=arguments.catalogue)
        seal, sealed = plant.seal(case)
    console.print(f"seed {arguments.seed}   seal sha256 {seal}")
    with console.status("the engine diagnoses, blind"):
        document = verdict(case)
    table = Table("held-out rms [um]", "given", "retuned", "explained", "noise", "verdict")
    _row(table, "the blind case", document["heldout"], _named(document))
    if not arguments.no_controls:
        with console.status("controls on the same motion"):
            controls(case, table)
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
