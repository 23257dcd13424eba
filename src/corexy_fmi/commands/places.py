"""Where commands write: never over what they read, and no two outputs into one file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.errors import InputError
from corexy_fmi.machine import machine_path


def file_place(text: str | Path) -> Path:
    """The place of a file; refuses an empty text, which would be the current folder."""
    if not str(text):
        raise typer.BadParameter("found no name, expected a place to write")
    return Path(text)


OutOption = Annotated[
    Path, typer.Option(metavar="FILE.csv", help="Where the recording goes.", parser=file_place)
]


def folder_place(text: str | Path) -> Path:
    """A place for results; refuses early what is a file, and an empty text."""
    place = file_place(text)
    if os.path.exists(place) and not place.is_dir():
        raise typer.BadParameter(f"{place} is a file, expected a folder")
    return place


def keep_apart(
    outputs: Iterable[Path | None], inputs: Iterable[Path | None], machine: str | None = None
) -> None:
    """Let a call neither write nor remove what it reads, ``machine``'s file too, whatever links.

    Raises InputError for that, and for two outputs into one file, before any work.
    """
    read = [path for path in inputs if path is not None]
    read += [] if machine is None else [machine_path(machine)]
    written: list[Path] = []
    for out in (path for path in outputs if path is not None):
        if any(os.path.isfile(path) and same_file(out, path) for path in read):
            raise InputError(f"{out}: is read by this command, expected another place to write")
        if any(same_file(out, path) for path in written):
            raise InputError(f"{out}: is to be written twice, expected a place for each")
        written.append(out)


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths are one file."""
    if os.path.exists(one) and os.path.exists(other):
        return one.samefile(other)
    return os.path.realpath(one) == os.path.realpath(other)
