"""An FMU is a zip archive: the same content gives the same bytes; a stranger's is checked first."""

from __future__ import annotations

import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.fmu.description import built_at

LARGEST, MOST = 1 << 29, 10_000  # bytes of an archive's files together, and their number
BROKEN = (OSError, zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError)


def write_archive(path: Path, content: Mapping[str, bytes]) -> None:
    """Write an archive beside its place and rename it; names sorted, one fixed time, no owner.

    Raises InputError where the place cannot be written.
    """
    with write_beside(path) as beside, zipfile.ZipFile(beside, "w") as archive:
        for name in sorted(content, key=_order):
            info = zipfile.ZipInfo(name, built_at().timetuple()[:6])
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, content[name], compresslevel=9)


def _order(name: str) -> tuple[bool, str]:
    """The description first: importers that stream need not read on."""
    return name != "modelDescription.xml", name


def read_archive(path: Path) -> dict[str, bytes]:
    """All files of an archive by name.  Raises InputError as `extract_archive` does."""
    with _checked(path) as archive:
        return {
            info.filename: archive.read(info) for info in archive.infolist() if not info.is_dir()
        }


def extract_archive(path: Path, folder: Path) -> None:
    """Unpack an archive into a folder, and nowhere else.

    Raises InputError, before anything is written, for entries that lead out of the folder, links,
    names that stand twice, encrypted ones, and more than `MOST` files or `LARGEST` bytes; also for
    what is no archive or is damaged.
    """
    with _checked(path) as archive:
        archive.extractall(folder)


@contextmanager
def _checked(path: Path) -> Iterator[zipfile.ZipFile]:
    """An open archive whose entries are harmless."""
    try:
        with zipfile.ZipFile(path) as archive:
            _check(path, archive.infolist())
            yield archive
    except BROKEN as error:
        raise InputError(f"{path}: cannot be unpacked: {error}, expected an FMU") from error


def _check(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    if len(entries) > MOST:
        raise InputError(f"{path}: {len(entries)} entries, expected an FMU with at most {MOST}")
    total = sum(info.file_size for info in entries)  # more than is told is not unpacked
    if total > LARGEST:
        raise InputError(f"{path}: {total} bytes unpacked, expected an FMU of at most {LARGEST}")
    seen: set[str] = set()
    for info in entries:
        wrong = _wrong(info)
        if wrong is None and info.filename in seen:
            wrong = "stands twice"
        if wrong is not None:
            raise InputError(f"{path}: entry {info.filename!r} {wrong}, expected an FMU")
        seen.add(info.filename)


def _wrong(info: zipfile.ZipInfo) -> str | None:
    """What is wrong with an entry; the mode of its file is told by Unix archives only."""
    name = info.orig_filename
    parts = name.removesuffix("/").split("/")
    kind = stat.S_IFMT(info.external_attr >> 16)
    if "\\" in name or ":" in name or "\0" in name or not {"", ".", ".."}.isdisjoint(parts):
        return "leads out of the archive's own folder"
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a device"
    return "is encrypted" if info.flag_bits & 1 else None
