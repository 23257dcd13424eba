"""An FMU is a zip archive: the same content gives the same bytes."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from corexy_fmi.files import write_beside
from corexy_fmi.fmu.description import built_at


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
    """All files of an archive by name."""
    with zipfile.ZipFile(path) as archive:
        return {
            info.filename: archive.read(info) for info in archive.infolist() if not info.is_dir()
        }
