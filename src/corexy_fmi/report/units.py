"""In which unit the pooled held-out mismatch is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from corexy_fmi.report.quantities import TIMES, channel_unit

NOISES = f"{TIMES} noise"


def heldout_unit(document: Mapping[str, Any]) -> tuple[str, float]:
    """Unit and scale of ``heldout``: that of its channels, else multiples of the noise.

    The engine pools x and y where they were measured, else all held-out channels.
    """
    rows = document.get("fit") or []
    judged = [r for r in rows if r.get("role") == "holdout"] or rows
    chosen = [r for r in judged if r.get("channel") in ("x", "y")] or judged
    units = {channel_unit(str(r.get("channel"))) for r in chosen}
    if len(units) == 1 and "" not in units:
        return units.pop(), 1.0
    noise = (document.get("heldout") or {}).get("noise_std")
    return (NOISES, 1 / noise) if noise else ("", 1.0)
