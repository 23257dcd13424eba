"""A table of numbers in a text file, read fast, with the line and column of its first mistake.

Good files are parsed in large blocks by NumPy; only a block that fails is looked at cell by cell.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError

LARGEST = 1e12  # of any number in SI units: what is beyond is no measurement
BLOCK = 1 << 23  # [byte] of text parsed at a time
ALLOWED = b"0123456789.eE+-, \t\r\n"
AROUND = re.compile(rb"[ \t]*([,\n])[ \t]*")


def read_table(
    stream: BinaryIO, path: Path, columns: Sequence[str], first_line: int
) -> NDArray[np.float64]:
    """The rest of ``stream`` as (rows, columns), NaN where a cell is blank.

    ``first_line`` is the number of the next line in the file.  Raises InputError naming line and
    column of the first cell that is no number, or the line that has too few or too many cells.
    """
    blocks, line = [], first_line
    for block in _blocks(stream):
        blocks.append(_parse(block, path, columns, line))
        line += len(blocks[-1])
    if not blocks:
        return np.empty((0, len(columns)))
    return np.concatenate(blocks)


def _blocks(stream: BinaryIO) -> Iterator[bytes]:
    """Whole lines, a block at a time, each ended by a newline; blank lines at the end fall off."""
    rest = b""
    while text := stream.read(BLOCK):
        rest += text
        cut = len(rest.rstrip().rpartition(b"\n")[0]) + 1  # a last line may still grow
        if cut > 1:
            yield rest[:cut].replace(b"\r\n", b"\n")
            rest = rest[cut:]
    if rest.strip():
        yield rest.rstrip().replace(b"\r\n", b"\n") + b"\n"


def _parse(block: bytes, path: Path, columns: Sequence[str], line: int) -> NDArray[np.float64]:
    """One block as (rows, columns)."""
    count = len(columns)
    if not block.translate(None, ALLOWED) and _rectangular(block, count):
        table = _parse_fast(block)
        if table is not None and not (np.abs(table) > LARGEST).any():
            return table
    return _parse_slowly(block, path, columns, line)


def _parse_fast(block: bytes) -> NDArray[np.float64] | None:
    """One block as (rows, columns), None where some cell is no number."""
    lines = _filled(block).decode("ascii").split("\n")[:-1]
    try:
        return np.loadtxt(lines, delimiter=",", ndmin=2)
    except ValueError:
        return None


def _rectangular(block: bytes, count: int) -> bool:
    """Whether every line holds count - 1 commas."""
    characters = np.frombuffer(block, dtype=np.uint8)
    ends = np.flatnonzero(characters == ord("\n"))
    commas = np.searchsorted(np.flatnonzero(characters == ord(",")), ends)
    return bool(np.all(np.diff(commas, prepend=0) == count - 1))


def _filled(block: bytes) -> bytes:
    """Blank cells written as nan."""
    if b" " in block or b"\t" in block:
        block = AROUND.sub(rb"\1", block).lstrip()
    block = block.replace(b",,", b",nan,").replace(b",,", b",nan,")
    block = block.replace(b",\n", b",nan\n").replace(b"\n,", b"\nnan,")
    return b"nan" + block if block.startswith(b",") else block


def _parse_slowly(
    block: bytes, path: Path, columns: Sequence[str], line: int
) -> NDArray[np.float64]:
    """Cell by cell: finds the mistake that stopped the fast way."""
    text = block.decode("utf-8", errors="replace")
    rows = [
        _row(cells, path, columns, number)
        for number, cells in enumerate(text.split("\n")[:-1], start=line)
    ]
    return np.array(rows, dtype=float).reshape(-1, len(columns))


def _row(text: str, path: Path, columns: Sequence[str], line: int) -> list[float]:
    """The numbers of one line."""
    cells = text.split(",")
    if text.startswith("#"):
        raise InputError(f"{path}, line {line}: a # line after the header, expected numbers")
    if len(cells) != len(columns):
        raise InputError(
            f"{path}, line {line}: {len(cells)} cells, expected {len(columns)} as in the header"
        )
    return [
        _number(cell, f"{path}, line {line}, column {column}")
        for cell, column in zip(cells, columns, strict=True)
    ]


def _number(cell: str, where: str) -> float:
    """One cell; blank is NaN, everything that is not a plain finite number is an error."""
    cell = cell.strip()
    if not cell:
        return float("nan")
    plain = cell.isascii() and not cell.encode().translate(None, ALLOWED) and "," not in cell
    try:
        number = float(cell) if plain else float("nan")
    except ValueError:
        number = float("nan")
    if not np.isfinite(number):
        raise InputError(f"{where}: found {cell[:40]!r}, expected a finite number or a blank cell")
    if abs(number) > LARGEST:
        raise InputError(f"{where}: found {cell[:40]!r}, expected a number within {LARGEST:g}")
    return number
