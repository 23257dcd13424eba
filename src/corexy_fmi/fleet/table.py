"""Rows of the table: what a diagnosis says, or why there is none."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

Row = dict[str, Any]
NUMBERS = ("heldout_nominal", "heldout_before", "heldout_after", "heldout_noise")
KEYS = ("rms_nominal", "rms_retuned", "rms_explained", "noise_std")
NAMED = ("machine", "verdict", "causes", "places", "probability")
COLUMNS = (*NAMED, *NUMBERS, "weak", "assumed", "seconds", "error")


def told(name: str, document: Mapping[str, Any]) -> Row:
    """A row out of diagnosis.json (CONTRACT 4).

    ``heldout_before`` and ``_after`` are the rms [SI] of the data kept back with the retuned and
    with the explained machine.  Of several causes the least probability counts.
    """
    effects, held = document["effects"], document["heldout"]
    numbers = {column: held.get(key) for column, key in zip(NUMBERS, KEYS, strict=True)}
    return {
        "machine": name,
        "verdict": document["verdict"],
        "causes": [e["name"] for e in effects],
        "places": [e["location"] for e in effects],
        "probability": min((e["probability"] for e in effects), default=None),
        **numbers,
        "weak": held["weak"],
        "assumed": document["machine_assumed"],
        "seconds": document["seconds"],
        "error": None,
    }


def failed(name: str, error: str) -> Row:
    """The row of a machine that could not be diagnosed, with one line that says why."""
    line = " ".join(error.split())
    row: Row = dict.fromkeys(COLUMNS)
    return row | {"machine": name, "causes": [], "places": [], "error": line}


def as_csv(rows: Sequence[Row]) -> str:
    """The table as CSV; several causes are joined by " + "."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        joined = {key: " + ".join(row[key]) for key in ("causes", "places")}
        writer.writerow({key: row[key] for key in COLUMNS} | joined)
    return text.getvalue()


def as_document(rows: Sequence[Row]) -> dict[str, Any]:
    """The table as JSON."""
    return {"schema": 1, "machines": list(rows)}
