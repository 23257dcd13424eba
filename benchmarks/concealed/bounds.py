"""Whether the bounds of a diagnosis (`not_excluded`) hold what was planted and not named."""

from __future__ import annotations

from typing import Any

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.naming.untold import strength

Row = dict[str, Any]


def bounded(document: dict[str, Any], truth: dict[str, Any]) -> list[Row]:
    """Each planted effect that was not named, with its bound and whether that holds it; none where
    it has no bound at its place, or no size (what belongs to one recording).
    """
    bounds = {(row["name"], row["location"]): row for row in document["not_excluded"]}
    planted = [(e, bounds.get((e["name"], e["location"]))) for e in truth["effects"]]
    rows = [_row(effect, bound) for effect, bound in planted if bound is not None]
    return [row for row in rows if row is not None]


def _row(effect: dict[str, Any], bound: Row) -> Row | None:
    size = catalogue()[effect["name"]].size
    if size.name not in effect["parameters"]:
        return None
    allowed = bound["upper95"] - (size.neutral if size.scaling >= 0 else 0.0)
    planted = strength(size, effect["parameters"][size.name])
    told = {"effect": effect["name"], "location": effect["location"]}
    return told | {"planted": planted, "allowed": allowed, "holds": planted <= allowed}
