"""The warning strip: what a reader must know before believing the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from corexy_fmi.engine.evidence import Evidence
from corexy_fmi.report.quantities import number, quantity
from corexy_fmi.report.units import heldout_unit
from corexy_fmi.report.words import full_stop, sentence

FAR = 3.0  # prior sigmas
AGREES = 1.1  # rms over noise
WARMER = "Look for missed steps, slip, a clock that runs off, or let it warm up before recording."


@dataclass(frozen=True)
class Notice:
    """One warning and what to do about it."""

    text: str
    fix: str = ""


def make_notices(document: Mapping[str, Any], evidence: Evidence) -> list[Notice]:
    """Wiring and units first, then far pulls, assumed numbers, a weak proof."""
    found = [Notice(full_stop(f.text), full_stop(f.fix)) for f in evidence.preflight]
    found += [_pull(name, entry) for name, entry in far_pulls(document)]
    if document.get("machine_assumed"):
        name = evidence.machine_name or "yin2018"
        found.append(
            Notice(
                f"No machine file was given: the surrogate {name} was assumed.",
                "Pass your own with --machine.",
            )
        )
    if evidence.surrogate:
        found.append(
            Notice(
                full_stop(f"Stand-in numbers: {evidence.surrogate}"),
                "Measure them where they matter.",
            )
        )
    found += [_drift(row) for row in document.get("repeats", ()) if row["drift"]]
    held = document.get("heldout") or {}
    if document.get("verdict") == "nothing_missing" and above_noise(held):
        unit, scale = heldout_unit(document)
        rms, noise = (quantity(held[k] * scale, unit) for k in ("rms_retuned", "noise_std"))
        text = f"The held-out mismatch, {rms}, stands above the noise, {noise}."
        found.append(Notice(text, "Something small may be missing that could not be named."))
    if held.get("weak"):
        text = (
            "The proof is weak: no recording was held out, "
            "so the last part of each was kept back instead."
        )
        found.append(Notice(text, "Record another run and pass it with --holdout."))
    return found


def _drift(row: Mapping[str, Any]) -> Notice:
    """What changes from loop to loop."""
    when = "" if row["jump_at"] is None else f" at {number(row['jump_at'])} s"
    text = f"{row['recording']}: over {row['loops']} loops {row['channel']} shows {row['drift']}"
    return Notice(full_stop(text + when), WARMER)


def above_noise(held: Mapping[str, Any]) -> bool:
    """Whether what retuning left of the held-out data is more than noise (CONTRACT 4)."""
    retuned, noise = held.get("rms_retuned"), held.get("noise_std")
    return bool(retuned and noise and retuned > AGREES * noise)


def far_pulls(document: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Retuned parameters beyond three prior sigmas, farthest first."""
    table = document.get("retuned") or {}
    far = [(name, e) for name, e in table.items() if abs(e.get("pull") or 0) > FAR]
    return sorted(far, key=lambda item: -abs(item[1]["pull"]))


def _pull(name: str, entry: Mapping[str, Any]) -> Notice:
    """One parameter that had to go far from the machine file."""
    value = quantity(entry.get("value", math.nan), entry.get("unit", ""))
    words = sentence(name.replace("_", " "))
    pull = number(abs(entry["pull"]), 2)
    text = f"{words} had to be retuned to {value}, {pull} sigma from the machine file."
    return Notice(
        text, "Check that number: a wrong one can hide a missing effect, or stand in for it."
    )
