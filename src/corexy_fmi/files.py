"""Whole files or none: outputs are written beside their place and renamed when complete."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from corexy_fmi.errors import InputError

LOCK = ".lock"
PROGRAM = "next_experiment.csv"
RESULT_FILES = ("report.html", "diagnosis.json", "machine.toml", "CoreXY.fmu", PROGRAM)


@contextmanager
def write_beside(path: Path) -> Iterator[Path]:
    """Give a path in the same folder to write to; it takes the name ``path`` on success.

    On any exception, also an interrupt, nothing stays behind.  Raises InputError where the folder
    cannot be written.
    """
    beside = _beside(path)
    with _told(path, beside):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            yield beside
            os.replace(beside, path)
        finally:
            beside.unlink(missing_ok=True)


@contextmanager
def write_folder(folder: Path, replacing: Collection[str] = ()) -> Iterator[Path]:
    """Give a fresh folder to fill; its files move into ``folder`` once all are complete.

    Files of other names that ``folder`` already holds stay, but for those of an earlier result that
    is ``replacing`` them all.  Raises InputError where the place cannot be written.
    """
    folder = folder.absolute()
    beside = _beside(folder)
    with _told(folder, beside):
        try:
            beside.mkdir(parents=True)
            yield beside
            folder.mkdir(exist_ok=True)
            fresh = sorted(beside.iterdir())
            for item in fresh:
                os.replace(item, folder / item.name)
            for name in {*replacing} - {item.name for item in fresh}:
                (folder / name).unlink(missing_ok=True)
        finally:
            shutil.rmtree(beside, ignore_errors=True)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a folder that two runs at once would spoil; one that is killed lets go of it.

    Raises InputError where another run holds it, or where it cannot be written.
    """
    with _told(folder / LOCK, folder):
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / LOCK, timeout=0)
        try:
            lock.acquire()
        except Timeout:
            raise InputError(f"{folder}: another run is at work in it, expected one") from None
    try:
        yield
    finally:
        with suppress(OSError):  # Windows: while it is open
            (folder / LOCK).unlink()
        lock.release()


def _beside(path: Path) -> Path:
    """A name that nobody else uses, with the same ending, hidden."""
    if not path.name:
        raise InputError(f"{path}: has no name, expected a file or a folder to write")
    return path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")


@contextmanager
def _told(path: Path, beside: Path) -> Iterator[None]:
    """An error of the file system on the way to ``path`` is the user's to mend; others pass."""
    try:
        yield
    except OSError as error:
        ours = str(error.filename or "").startswith((str(beside), str(path.parent)))
        if not ours and error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        reason = error.strerror or str(error)
        raise InputError(
            f"{path}: cannot be written: {reason}, expected a place to write"
        ) from error
