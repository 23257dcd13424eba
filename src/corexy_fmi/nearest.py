"""The known name that a mistyped one was probably meant to be."""

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str], closeness: float = 0.0) -> str:
    """A hint such as ``; nearest known: carriage_mass``, empty where nothing is near."""
    match = difflib.get_close_matches(name, list(known), 1, closeness)
    return f"; nearest known: {match[0]}" if match else ""
