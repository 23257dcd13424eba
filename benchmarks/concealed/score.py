"""Scoring of one blind case by the contract: right, wrong and confident, or neither."""

from __future__ import annotations

from typing import Any

from corexy_fmi.engine.telling.classes import equals

SHARED = {"xy": ("x", "y"), "motors": ("motor1", "motor2")}
NEAR_TWIN = 100.0  # E_sep below which `ambiguous` is the right answer
SAME = 0.2  # relative: two entries with values this close equal one shared entry


def _expanded(effects: list[dict[str, Any]]) -> dict[tuple[str, str], dict[str, float]]:
    """(name, place) -> parameter values, shared places written out."""
    found = {}
    for effect in effects:
        values = {
            k: v["value"] if isinstance(v, dict) else v for k, v in effect["parameters"].items()
        }
        for place in SHARED.get(effect["location"], (effect["location"],)):
            found[effect["name"], place] = values
    return found


def _close(one: dict[str, float], other: dict[str, float]) -> bool:
    shared = [k for k in one if k in other and "phase" not in k]
    return all(abs(one[k] - other[k]) <= SAME * max(abs(one[k]), abs(other[k])) for k in shared)


def _same_split(said: list[dict[str, Any]], truth: list[dict[str, Any]]) -> bool:
    """Whether two entries stand for one shared one, or the other way round, with equal values."""
    a, b = _expanded(said), _expanded(truth)
    if set(a) != set(b):
        return False
    split = {(e["name"], e["location"]) for e in said} ^ {(e["name"], e["location"]) for e in truth}
    if not split:
        return True
    pairs = [
        (k, (k[0], q))
        for k in a
        for q in ("y", "motor2")
        if (k[0], q) in a and k[1] in ("x", "motor1")
    ]
    return all(_close(group[p], group[q]) for p, q in pairs for group in (a, b))


def right_set(document: dict[str, Any], truth: list[dict[str, Any]]) -> bool:
    """Whether the document names exactly the planted set."""
    return document["verdict"] == "explained" and _same_split(document["effects"], truth)


def _in_class(document: dict[str, Any], truth: list[dict[str, Any]]) -> bool:
    """Whether the truth is among the members of an ambiguous class."""
    wanted = {(e["name"], e["location"]) for e in truth}
    told = [members for group in equals(document) for members in group]
    return any({(m["name"], m["location"]) for m in members} == wanted for members in told)


def score(document: dict[str, Any], truth: dict[str, Any]) -> str:
    """One of right, class (ambiguous, truth in it), abstained, missed, false_alarm, wrong."""
    kind, verdict = truth["kind"], document["verdict"]
    if kind == "null":
        return "right" if verdict == "nothing_missing" else "false_alarm"
    if kind == "outside":
        return {"unexplained": "right", "explained": "wrong", "nothing_missing": "missed"}.get(
            verdict, "abstained"
        )
    if right_set(document, truth["effects"]):
        return "right"
    if verdict == "explained":
        return "wrong"
    if verdict == "ambiguous" and _in_class(document, truth["effects"]):
        return "class"
    return "missed" if verdict == "nothing_missing" else "abstained"


def fulfilled(outcome: str, truth: dict[str, Any]) -> bool:
    """Whether an outcome is what the data allow: near twins are to be left as a class."""
    twins = truth.get("E_sep") is not None and truth["E_sep"] < NEAR_TWIN
    return outcome == "right" or (twins and outcome == "class")
