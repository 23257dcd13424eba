"""One machine of a fleet, diagnosed wherever the task lands: files in, files and a row out."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from corexy_fmi.commands.diagnose import chosen_machine, read_all, write_diagnosis
from corexy_fmi.errors import InputError
from corexy_fmi.fleet.cases import Parcel
from corexy_fmi.fleet.table import Row, failed, told


def diagnose_parcel(parcel: Parcel) -> tuple[dict[str, bytes], Row]:
    """The files of a diagnosis and its row; no files and the error's line where it failed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            return _diagnosed(parcel, folder)
        except InputError as error:
            return {}, failed(parcel.name, str(error).replace(f"{folder}/given/", ""))
        except Exception as error:
            return {}, failed(parcel.name, f"{type(error).__name__}: {error}")


def _diagnosed(parcel: Parcel, folder: Path) -> tuple[dict[str, bytes], Row]:
    began = time.perf_counter()
    given, result = folder / "given", folder / "result"
    given.mkdir()
    result.mkdir()
    for file, content in parcel.files.items():
        (given / file).write_bytes(content)
    trains, holdouts = read_all(
        [given / n for n in parcel.train], [given / n for n in parcel.holdout]
    )
    own = parcel.machine in parcel.files
    name = str(given / parcel.machine) if parcel.machine and own else parcel.machine
    machine = chosen_machine(name, None, [*trains, *holdouts])
    document = write_diagnosis(
        result, trains, holdouts, machine, parcel.machine is None, 1, None, None, began
    )
    files = {path.name: path.read_bytes() for path in sorted(result.iterdir())}
    return files, told(parcel.name, document)
