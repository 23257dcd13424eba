"""Writing a recording to CSV: numbers that read back to the same bits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.recording.read import read_recording
from corexy_fmi.recording.record import Recording

ROWS = 65536  # written at a time


def write_recording(recording: Recording, path: str | Path, *, plain: bool = False) -> None:
    """Write the CSV, beside its place first; NaN is a blank cell.

    ``plain`` leaves the metadata lines out: such a file, if it has no blanks, is also an input that
    fmpy's own reader takes.  Raises InputError where the place cannot be written.
    """
    with (
        write_beside(Path(path)) as beside,
        beside.open("w", encoding="utf-8", newline="\n") as file,
    ):
        if not plain:
            file.writelines(
                f"# {_line(key)}: {_line(text)}\n" for key, text in recording.metadata.items()
            )
        file.write(",".join(["time", *recording.channels]) + "\n")
        file.writelines(_blocks([recording.time, *recording.channels.values()]))


def write_checked(recording: Recording, path: str | Path) -> None:
    """Write the CSV once it was read back as anybody would.

    Raises InputError naming line and column for what no recording may hold; nothing is written.
    """
    path = Path(path)
    with write_beside(path) as beside:
        write_recording(recording, beside)
        try:
            read_recording(beside)
        except InputError as error:
            raise InputError(str(error).replace(str(beside), str(path))) from error


def _line(text: str) -> str:
    """Metadata stand on one line."""
    return " ".join(str(text).split())


def _blocks(columns: list[NDArray[np.float64]]) -> Iterator[str]:
    """Text of ROWS rows at a time."""
    for start in range(0, len(columns[0]), ROWS):
        cells = [_cells(column[start : start + ROWS]) for column in columns]
        yield "\n".join(map(",".join, zip(*cells, strict=True))) + "\n"


def _cells(values: NDArray[np.float64]) -> list[str]:
    """Shortest text of each number that reads back exactly."""
    texts = list(map(repr, np.asarray(values, dtype=float).tolist()))
    return ["" if text == "nan" else text for text in texts]
