"""Classes of equals in diagnosis.json: tables as CONTRACT 4 has them, and sets of effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Classes = Sequence[Sequence[Sequence[tuple[str, str]]]]


def between(classes: Classes) -> list[list[dict[str, str]]]:
    """Classes of equals, as tables of name and location.

    Of sets of effects what all of them share is left out, where two others are left.
    """
    told = []
    for group in classes:
        members = dict.fromkeys(pair for key in group for pair in key)
        apart = [pair for pair in members if not all(pair in key for key in group if key)]
        told.append([_table(pair) for pair in (apart if len(apart) > 1 else members)])
    return told


def sets(classes: Classes) -> list[list[list[dict[str, str]]]]:
    """The same as sets of effects that act together; empty where no class has such a set."""
    together = any(len(key) > 1 for group in classes for key in group)
    whole = [[[_table(pair) for pair in key] for key in group if key] for group in classes]
    return whole if together else []


def equals(document: Mapping[str, Any]) -> list[list[list[Mapping[str, Any]]]]:
    """The classes that a document tells; each member is a list of what acts together."""
    told = document.get("ambiguous_sets") or document.get("ambiguous_between") or []
    return [[m if isinstance(m, list) else [m] for m in group] for group in told]


def unsized(document: Mapping[str, Any]) -> bool:
    """Whether a cause is sure, but not its size: its class then stands against nothing."""
    return any(e.get("size_is_sure") is False for e in document.get("effects") or [])


def _table(pair: tuple[str, str]) -> dict[str, str]:
    return {"name": pair[0], "location": pair[1]}
