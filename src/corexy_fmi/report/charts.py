"""Charts that are drawn by the page itself: bars of the held-out rms, pulls, the stage."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from corexy_fmi.engine.telling.classes import equals
from corexy_fmi.report.notices import FAR
from corexy_fmi.report.quantities import number, quantity
from corexy_fmi.report.tables import words
from corexy_fmi.report.units import heldout_unit

ROWS = (
    ("as given", "rms_nominal", "nominal"),
    ("retuned", "rms_retuned", "retuned"),
    ("explained", "rms_explained", "explained"),
    ("noise", "noise_std", "noise"),
)
PARTS = {
    "x": {"x"}, "y": {"y"}, "xy": {"x", "y"}, "motors": {"motor1", "motor2"},
    "phi1": {"motor1"}, "phi2": {"motor2"},
}  # fmt: skip


@dataclass(frozen=True)
class Bar:
    """One bar: its label, its value in words, its width and, for a pull, where it starts."""

    label: str
    text: str
    width: float  # [% of the chart]
    colour: str
    start: float = 0.0


def rms_bars(document: Mapping[str, Any]) -> list[Bar]:
    """Held-out rms as given, retuned and explained, beside the noise; empty where unknown."""
    held, (unit, scale) = document.get("heldout") or {}, heldout_unit(document)
    told = [row for row in ROWS if _finite(held.get(row[1]))]
    if document.get("verdict") == "nothing_missing":  # there, explained is retuned
        told = [row for row in told if row[0] != "explained"]
    top = max((held[key] for _, key, _ in told), default=0.0)
    if not top:
        return []
    return [
        Bar(label, quantity(held[key] * scale, unit), max(100 * held[key] / top, 0.6), colour)
        for label, key, colour in told
    ]


def _finite(value: object) -> bool:
    """Whether this is a number to draw."""
    return isinstance(value, int | float) and math.isfinite(value)


def pull_bars(document: Mapping[str, Any]) -> tuple[list[Bar], float]:
    """Pulls around the middle of a chart, and how far [%] from it three sigmas lie."""
    table = {n: float(e.get("pull") or 0.0) for n, e in (document.get("retuned") or {}).items()}
    limit = 1.15 * max(FAR, *(abs(p) for p in table.values()), 0.0)
    bars = []
    for name, pull in table.items():
        width = 50 * abs(pull) / limit
        colour = "far" if abs(pull) > FAR else "near"
        bars.append(
            Bar(words(name), number(pull, 2), width, colour, 50 - (width if pull < 0 else 0))
        )
    return bars, 50 * FAR / limit


def marked_parts(document: Mapping[str, Any]) -> set[str]:
    """Parts of the stage's drawing to mark: where the effects are, else where the mismatch is."""
    places = [e.get("location") for e in document.get("effects") or []]
    for group in equals(document):
        places += [m.get("location") for together in group for m in together]
    where = (document.get("located") or {}).get("coordinate")
    if document.get("verdict") == "unexplained" and where:
        places = [where]  # the law beside it is one shape of it, not its place
    places = [p for p in places if p] or [where]
    return {part for p in places if p for part in PARTS.get(p, {p})}
