"""The standard streams, whatever they are: closed, full, of a narrow encoding."""

from __future__ import annotations

import errno
import io
import os
import sys
from contextlib import suppress

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


def open_streams() -> None:
    """Streams that are closed lead nowhere; what an encoding lacks is written with backslashes."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def encodes_all() -> bool:
    """Whether stdout can show any letter as it is."""
    return (getattr(sys.stdout, "encoding", None) or "utf-8").lower().startswith("utf")


def trouble(error: OSError) -> str | None:
    """A line for an error of the process's surroundings; None where it is something else."""
    if error.errno in FULL and error.filename is None:
        return f"stdout or a temporary file: {error.strerror}, expected room to write"
    try:
        os.getcwd()
    except OSError:
        return f"the folder that you are in: {error.strerror}, expected one that is there"
    return None


def mute() -> None:
    """What stdout still holds goes nowhere, so that the process can end."""
    with suppress(OSError):  # a stream without a file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
