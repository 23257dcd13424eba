"""The recording as it grows: whole lines on the disk, so that a killed host loses nothing."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import BinaryIO

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.hil.drive import Drive
from corexy_fmi.hil.record import NEAR, rows

EVERY, BEHIND = 0.2, 0.3  # [s] between two writings, and by which they lag, for late samples


def part_of(out: Path) -> Path:
    """Where the growing recording of a run lies."""
    return out.with_name(f"{out.stem}.part.csv")


class LiveFile:
    """Appends rows while a drive runs; call it with the drive.  A recording at every moment.

    Raises InputError where the disk takes no more; whole lines written before stay.
    """

    def __init__(self, path: Path, begin: float, about: dict[str, str]) -> None:
        self.path, self._begin = path, begin
        self._done = begin - NEAR
        self._about = about
        self._file: BinaryIO | None = None
        self._good = 0

    def __enter__(self) -> LiveFile:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("wb", buffering=0)
        except OSError as error:
            raise self._full(error) from error
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._file is not None:
            self._file.close()

    def __call__(self, drive: Drive) -> None:
        """Write what is complete, where some of it is due."""
        until = min(drive.time - BEHIND, drive.plan.time[-1])
        if until - self._done < EVERY or not drive.board.clock.samples:
            return
        time, channels = rows(drive.log, drive.board, drive.tracker, self._done + NEAR, until)
        if self._good == 0:
            head = [f"# {key}: {text}\n" for key, text in {**self._about, "run": "part"}.items()]
            self._write("".join(head) + ",".join(["time", *channels]) + "\n")
        table = np.column_stack([time - self._begin, *channels.values()])
        self._write("".join(_line(row) for row in table.tolist()))
        self._done = until

    def _write(self, text: str) -> None:
        """All of a text or none of it."""
        assert self._file is not None
        data = text.encode()
        try:
            written = self._file.write(data)
            while written is not None and written < len(data):
                written += self._file.write(data[written:]) or 0
        except OSError as error:
            self._file.truncate(self._good)
            raise self._full(error) from error
        self._good += len(data)

    def _full(self, error: OSError) -> InputError:
        reason = error.strerror or str(error)
        return InputError(f"{self.path}: cannot be written: {reason}, expected a disk with room")


def _line(row: list[float]) -> str:
    return ",".join("" if value != value else repr(value) for value in row) + "\n"
