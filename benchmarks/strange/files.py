"""A case as files, and its seal."""

from __future__ import annotations

import csv
import hashlib
import json
from pathlib import Path

from benchmarks.shop.case import HOLDOUT, TRAIN
from benchmarks.strange.draw import Drawn

FILES, MACHINE = TRAIN + HOLDOUT, "machine.toml"


def write(case: Drawn, folder: Path) -> None:
    """The machine file and the recordings; a row without a sample has blank cells."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MACHINE).write_text(case.file, encoding="utf-8")
    for name, columns in zip(FILES, case.tables, strict=True):
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        with (folder / name).open("w", newline="", encoding="utf-8") as file:
            file.write("" if case.sensor.offsets is not None else "# zero: x, y\n")
            loop = "# controller: pd kp={kp!r} kd={kd!r}\n"
            file.write(loop.format(**case.machine.numbers) if case.machine.dc else "")
            out = csv.writer(file)
            out.writerow(columns)
            out.writerows(["" if v != v else repr(v) for v in row] for row in rows)


def seal(case: Drawn, folder: Path) -> str:
    """Hash of the truth and of the files that were written."""
    hashes = {n: hashlib.sha256((folder / n).read_bytes()).hexdigest() for n in (MACHINE, *FILES)}
    text = json.dumps({"truth": case.truth, "files": hashes}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
