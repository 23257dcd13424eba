"""Values of a machine file, checked one at a time; every refusal is one line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from corexy_fmi.errors import InputError
from corexy_fmi.nearest import nearest


def table(entry: Any, where: str) -> dict[str, Any]:
    """The entry if it is a table."""
    if not isinstance(entry, dict):
        raise InputError(f"{where}: found {shown(entry)}, expected a table")
    return entry


def text(entry: Any, where: str) -> str:
    """The entry if it is text of one line, without characters that XML or a screen cannot show."""
    if not isinstance(entry, str) or not entry.strip() or not entry.isprintable():
        raise InputError(f"{where}: found {shown(entry)}, expected printable text of one line")
    return entry


def choice(entry: Any, known: Iterable[str], where: str) -> str:
    """The entry if it is one of the known names."""
    known = tuple(known)
    if not isinstance(entry, str) or entry not in known:
        listed = ", ".join(repr(name) for name in known)
        hint = nearest(entry, known) if isinstance(entry, str) else ""
        raise InputError(f"{where}: found {shown(entry)}, expected one of {listed}{hint}")
    return entry


def number(
    entry: Any, lower: float, upper: float, unit: str, where: str, kind: str = "a number"
) -> float:
    """The entry as float if it is a finite number inside its bounds; true and false are none."""
    if isinstance(entry, bool) or not isinstance(entry, int | float) or not _finite(entry):
        raise InputError(f"{where}: found {shown(entry)}, expected {kind} [{unit}]")
    if not lower <= entry <= upper:
        raise InputError(
            f"{where}: found {entry!r}, expected a value from {lower:g} to {upper:g} [{unit}]"
        )
    return float(entry)


def _finite(entry: float) -> bool:
    """Whether a number is finite as a float."""
    try:
        return math.isfinite(entry)
    except OverflowError:  # a whole number of hundreds of digits
        return False


def refuse_unknown(given: Mapping[str, Any], known: Iterable[str], where: str, kind: str) -> None:
    """Raises InputError for the first key that nobody would read."""
    known = tuple(known)
    for key in given:
        if key not in known:
            listed = f", expected one of {', '.join(known)}" if len(known) < 8 else ""
            raise InputError(f"{where}: unknown {kind} {key!r}{listed}{nearest(key, known)}")


def shown(entry: Any) -> str:
    """An entry as the file may have written it, short, on one line."""
    written = str(entry).lower() if isinstance(entry, bool) else repr(entry)
    return written if len(written) <= 60 else written[:57] + "..."
