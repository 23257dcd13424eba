"""Whole files or none: outputs are written beside their place and renamed when complete."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from corexy_fmi.errors import InputError

LOCK = ".lock"
PROGRAM = "next_experiment.csv"
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # of a disk, a quota, a file
RESULT_FILES = ("report.html", "diagnosis.json", "machine.toml", "CoreXY.fmu", PROGRAM)


@contextmanager
def write_beside(path: Path) -> Iterator[Path]:
    """Give a path in the same folder to write to; it takes the name ``path`` on success.

    Where ``path`` is a link, what it points at is written, and a file keeps its mode; a FIFO or
    a device takes the whole text at the end.  On any exception, also an interrupt, nothing stays
    behind.  Raises InputError where the folder cannot be written.
    """
    place = Path(os.path.realpath(path))
    if os.path.exists(path) and not (place.is_file() or place.is_dir()):
        with _through(path) as whole:
            yield whole
        return
    beside = _beside(place if path.name else path)
    with _told(path, place, beside), _made(place.parent):
        try:
            yield beside
            if place.is_file():
                shutil.copymode(place, beside)
            os.replace(beside, place)
        finally:
            beside.unlink(missing_ok=True)


@contextmanager
def _through(path: Path) -> Iterator[Path]:
    """Give a file to fill elsewhere; what is no regular file takes its bytes, and stays."""
    with tempfile.TemporaryDirectory(prefix="corexy-") as folder:
        whole = Path(folder) / path.name
        yield whole
        try:
            with whole.open("rb") as file, os.fdopen(os.open(path, os.O_WRONLY), "wb") as sink:
                shutil.copyfileobj(file, sink)
        except OSError as error:
            raise _refusal(path, error) from error


@contextmanager
def write_folder(folder: Path, replacing: Collection[str] = ()) -> Iterator[Path]:
    """Give a fresh folder to fill; its files move into ``folder`` once all are complete.

    Files of other names that ``folder`` already holds stay, but for those of an earlier result that
    is ``replacing`` them all.  Raises InputError where the place cannot be written.
    """
    place = Path(os.path.realpath(folder))
    beside = _beside(place)
    with _told(folder, place, beside), _made(place.parent):
        try:
            beside.mkdir()
            yield beside
            place.mkdir(exist_ok=True)
            fresh = sorted(beside.iterdir())
            for item in fresh:
                os.replace(item, place / item.name)
            for name in {*replacing} - {item.name for item in fresh}:
                (place / name).unlink(missing_ok=True)
        finally:
            shutil.rmtree(beside, ignore_errors=True)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a folder that two runs at once would spoil; one that is killed lets go of it.

    Raises InputError where another run holds it, or where it cannot be written.
    """
    with ExitStack() as stack:
        with _told(folder / LOCK, folder.absolute(), folder):
            stack.enter_context(_made(folder))
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
def _made(folder: Path) -> Iterator[None]:
    """A folder that is there; those made for it go again where what follows fails."""
    fresh = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for path in fresh:
            with suppress(OSError):  # somebody put something into it
                path.rmdir()
        raise


@contextmanager
def _told(path: Path, *places: Path) -> Iterator[None]:
    """An error of the file system on the way to ``path`` is the user's to mend; others pass.

    On the way are ``places``, absolute, with what they hold, and the folders above them.
    """
    try:
        yield
    except OSError as error:
        named = Path(str(error.filename or ""))
        ours = any(named.is_relative_to(p) or p.is_relative_to(named) for p in places)
        if not ours and error.errno not in NO_ROOM:
            raise
        raise _refusal(path, error) from error


def _refusal(path: Path, error: OSError) -> InputError:
    reason = error.strerror or str(error)
    return InputError(f"{path}: cannot be written: {reason}, expected a place to write")
