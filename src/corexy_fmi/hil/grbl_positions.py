"""A side file of a GRBL run: the places that the controller reported."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_drive import Drive
from corexy_fmi.hil.grbl_moves import Grid

HEADER = (
    "# commanded positions as the controller reported them [m], not measured\n"
    "sent,heard,state,x_commanded,y_commanded\n"
)


class Positions:
    """A side file of the places that the controller reports: commanded, never measured."""

    def __init__(self, path: Path, grid: Grid) -> None:
        self.path, self._grid, self._done = path, grid, 0
        self._file: TextIO | None = None

    def __call__(self, drive: Drive) -> None:
        """Write the reports that are new."""
        for heard in drive.log.reports[self._done :]:
            place = heard.report.place(drive.link.offset)
            if place is not None:
                x, y = (
                    (np.array(place) - np.array(self._grid.centre) / self._grid.per_mm) / 1e3
                ).tolist()
                self._write(f"{heard.sent!r},{heard.heard!r},{heard.report.state},{x!r},{y!r}\n")
        self._done = len(drive.log.reports)

    def _write(self, row: str) -> None:
        try:
            if self._file is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = self.path.open("w", encoding="utf-8", buffering=1)
                self._file.write(HEADER)
            self._file.write(row)
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written: {error.strerror}, expected a disk "
                             "with room") from error  # fmt: skip

    def close(self) -> None:
        """No more rows."""
        if self._file is not None:
            self._file.close()
