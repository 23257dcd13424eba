"""Where results are kept: ``OUT/MACHINE/result``, whole or not at all.

    OUT/MACHINE/result/..   diagnosis.json, report.html, machine.toml, CoreXY.fmu
    OUT/MACHINE/result/row.json   the fingerprint of what was diagnosed, and the row of the table
    OUT/fleet.csv, OUT/fleet.json the table

A machine is done where ``row.json`` has its fingerprint and ``diagnosis.json`` is the one that it
was written for.  Errors are not kept: they are tried again.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from corexy_fmi.files import RESULT_FILES, write_beside, write_folder
from corexy_fmi.fleet.cases import Parcel
from corexy_fmi.fleet.table import Row, as_csv, as_document

RESULT, ROW, DIAGNOSIS = "result", "row.json", "diagnosis.json"


class Store:
    """Keeps the results of machines under a folder."""

    def __init__(self, out: Path) -> None:
        self.out = out

    def place(self, name: str) -> Path:
        """The folder of a machine's result."""
        return self.out / name / RESULT

    def done(self, parcel: Parcel) -> Row | None:
        """The row of a machine that is done; None where it has to be diagnosed."""
        place = self.place(parcel.name)
        try:
            held = json.loads((place / ROW).read_text(encoding="utf-8"))
            whole = hashlib.sha256((place / DIAGNOSIS).read_bytes()).hexdigest()
            same = held["fingerprint"] == parcel.fingerprint and held["diagnosis"] == whole
            return dict(held["row"]) if same else None
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def keep(self, parcel: Parcel, files: Mapping[str, bytes], row: Row) -> None:
        """Write a machine's files beside and rename them, then its row."""
        place = self.place(parcel.name)
        place.parent.mkdir(parents=True, exist_ok=True)
        for stray in place.parent.glob(f".{RESULT}-*"):  # of a run that was killed
            shutil.rmtree(stray, ignore_errors=True)
        with write_folder(place, RESULT_FILES) as beside:
            for name, content in files.items():
                (beside / name).write_bytes(content)
        whole = hashlib.sha256(files[DIAGNOSIS]).hexdigest()
        held = {"fingerprint": parcel.fingerprint, "diagnosis": whole, "row": row}
        _write(place / ROW, json.dumps(held, indent=1, ensure_ascii=False) + "\n")

    def table(self, rows: Sequence[Row]) -> None:
        """Write the fleet's table as CSV and as JSON."""
        _write(self.out / "fleet.csv", as_csv(rows))
        text = json.dumps(as_document(rows), indent=1, ensure_ascii=False, allow_nan=False)
        _write(self.out / "fleet.json", text + "\n")


def _write(path: Path, text: str) -> None:
    for stray in path.parent.glob(f".{path.stem}-*{path.suffix}"):  # of a run that was killed
        stray.unlink(missing_ok=True)
    with write_beside(path) as beside:
        beside.write_text(text, encoding="utf-8")
