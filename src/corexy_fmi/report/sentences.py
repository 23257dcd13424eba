"""Sentences and actions that verdicts share: how far a corner moves, what held-out data say,
what to do about a cause.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from corexy_fmi.engine.evidence import CornerSize
from corexy_fmi.report.quantities import millimetres, quantity
from corexy_fmi.report.units import heldout_unit
from corexy_fmi.report.words import cause, full_stop, sentence

Document = Mapping[str, Any]
SEEN = 1.01  # rms over noise, below which what is removed of the difference says nothing
VISIBLE = 5e-4  # [mm] below which a corner's change is not worth a headline


@dataclass(frozen=True)
class Action:
    """One thing to do on the machine, and how to confirm it by hand."""

    title: str
    do: str
    check: str = ""


def remedies(document: Document, before: str = "") -> list[Action]:
    """What to do about each effect, and how to confirm it."""
    effects = document.get("effects") or []
    titles = [f"{before}{cause(e)}" for e in effects]
    return [
        Action(
            title if before else sentence(title),
            full_stop(e.get("remedy")),
            full_stop(e.get("check")),
        )
        for title, e in zip(titles, effects, strict=True)
    ]


def worth_telling(corner: CornerSize | None) -> CornerSize | None:
    """The corner, where the effect changes it visibly."""
    if corner is None or not abs(corner.with_effect_mm - corner.without_effect_mm) >= VISIBLE:
        return None
    return corner


def corner_sentence(corner: CornerSize | None, it: str) -> tuple[str, ...]:
    """How far the path misses the corner with and without the effect."""
    if corner is None:
        return ()
    now, then = (millimetres(v) for v in (corner.with_effect_mm, corner.without_effect_mm))
    told = f"With {it} the path misses the corner by {now}, without {it} by {then}"
    return (f"{told} ({corner.recording}).",)


def seen(held: Mapping[str, Any]) -> bool:
    """Whether the held-out mismatch of the retuned machine stands out of the noise as an rms."""
    return known(held, "rms_retuned", "noise_std") and bool(
        held["rms_retuned"] >= SEEN * held["noise_std"]
    )


def gain_sentence(document: Document) -> tuple[str, ...]:
    """How far the held-out mismatch falls."""
    held = document.get("heldout") or {}
    if not known(held, "rms_retuned", "rms_explained", "noise_std"):
        return ()
    unit, scale = heldout_unit(document)
    before, after, noise = (
        quantity(held[k] * scale, unit) for k in ("rms_retuned", "rms_explained", "noise_std")
    )
    if not seen(held):
        return (
            "On data kept out of the fit what is missing is too small beside the noise "
            f"({noise}) to show in an rms.",
        )
    change = f"falls from {before} to {after}"
    if before == after:
        change = f"stays at {before}"
    elif held["rms_explained"] > held["rms_retuned"]:
        change = f"grows from {before} to {after}"
    return (f"On data kept out of the fit the mismatch {change}; noise alone is {noise}.",)


def next_experiment(document: Document) -> tuple[Action, ...]:
    """The experiment that would decide, if there is one."""
    plan = document.get("next_experiment") or {}
    if not plan.get("why"):
        return ()
    program = f"Run the program {plan['program']}." if plan.get("program") else ""
    return (Action("Next experiment", full_stop(sentence(plan["why"])), program),)


def known(table: Mapping[str, Any], *keys: str) -> bool:
    """Whether all of these hold a number."""
    return all(isinstance(table.get(k), int | float) and math.isfinite(table[k]) for k in keys)
