"""What a verdict is worth beside the truth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.concealed.calibration import rate
from benchmarks.shop.case import AMBIGUOUS, EXPLAINED, NOTHING, UNEXPLAINED, Pair, Truth
from corexy_fmi.engine.telling.classes import equals

RIGHT, PLACE, ABSTAINED, MISSED = "right", "place right", "abstained", "missed"
WRONG, ALARM = "wrong and sure", "false alarm"
GRADES = (RIGHT, PLACE, ABSTAINED, MISSED, WRONG, ALARM)
Told = Mapping[str, Any]


def pairs(effects: Sequence[Mapping[str, Any]]) -> frozenset[Pair]:
    """Names and places."""
    return frozenset((e["name"], e["location"]) for e in effects)


def sets(told: Told) -> list[frozenset[Pair]]:
    """What is named; of an ambiguous verdict every set among which it leaves the choice."""
    if told["verdict"] == AMBIGUOUS:
        return [pairs(member) for group in equals(told) for member in group if member]
    return [pairs(told["effects"])] if told["verdict"] == EXPLAINED else []


def grade(truth: Truth, told: Told) -> str:
    """One of `GRADES`: a cause counts whole, nothing beside it; a place by itself."""
    verdict = told["verdict"]
    if any(named in truth.causes for named in sets(told)):
        return RIGHT
    if verdict == EXPLAINED:
        return WRONG
    if verdict == NOTHING:
        return RIGHT if NOTHING in truth.allowed else MISSED
    if truth.allowed == {NOTHING}:
        return ALARM if verdict in (UNEXPLAINED, AMBIGUOUS) else ABSTAINED
    return PLACE if told["coordinate"] in truth.places else ABSTAINED


def as_allowed(truth: Truth, told: Told) -> bool:
    """Whether the verdict is one of those that the case allows, and what it names is right."""
    named = bool(truth.causes) and told["verdict"] in (EXPLAINED, AMBIGUOUS)
    return told["verdict"] in truth.allowed and (not named or grade(truth, told) == RIGHT)


def summary(judged: Sequence[tuple[Truth, Told]], of: int) -> str:
    """Counts of grades and Wilson bounds; of how many cases, where some are not run."""
    if not judged:
        return f"None of {of} cases was run so far."
    grades = Counter(grade(*each) for each in judged)
    counts = ", ".join(f"{name} {grades[name]}" for name in GRADES if grades[name])
    allowed = sum(as_allowed(*each) for each in judged)
    part = f"{len(judged)} of {of} cases run so far" if len(judged) < of else f"All {of} cases"
    return (
        f"{part}: {counts}. As allowed: {rate(allowed, len(judged))}. "
        f"Wrong and sure: {rate(grades[WRONG], len(judged))} (Wilson 95 %)."
    )
