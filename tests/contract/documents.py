"""What diagnosis.json must look like (CONTRACT 4): a list of what is wrong with a document."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

VERDICTS = ("explained", "ambiguous", "unexplained", "nothing_missing")
STATES = (
    "velocity_reversal", "speed", "position", "motor_angle", "load", "acceleration", "voltage",
    "time", "constant",
)  # fmt: skip
COORDINATES = (
    "x", "y", "xy", "motor1", "motor2", "motors", "belts", "bridge", "frame", "tool", "sensor",
    *(f"pulley{i}" for i in range(3, 11)),
)  # fmt: skip
ROOT = (
    "schema", "verdict", "effects", "ambiguous_between", "next_experiment", "located", "fit",
    "heldout", "retuned", "not_excluded", "machine_assumed", "seconds",
)  # fmt: skip
RMS = ("rms_nominal", "rms_retuned", "rms_explained")
DECISIVE, SAME = 0.95, 1e-9

Problems = Iterator[str]


def problems(document: Mapping[str, Any]) -> list[str]:
    """Every way in which a diagnosis breaks the contract, each as one line; empty when none."""
    missing = [f"{key}: missing" for key in ROOT if key not in document]
    if missing:
        return missing
    checks: tuple[Callable[[Mapping[str, Any]], Problems], ...] = (
        _root, _effects, _located, _fit, _heldout, _retuned, _not_excluded, _verdict,
    )  # fmt: skip
    return [problem for check in checks for problem in check(document)]


def _root(document: Mapping[str, Any]) -> Problems:
    if document["schema"] != 1:
        yield "schema: not 1"
    if document["verdict"] not in VERDICTS:
        yield f"verdict: {document['verdict']!r}"
    if not isinstance(document["machine_assumed"], bool):
        yield "machine_assumed: not true or false"
    yield from _number(document, "seconds", "", 0.0, math.inf)
    experiment = document["next_experiment"]
    if experiment is not None:
        yield from _texts(experiment, ("why", "program"), "next_experiment")


def _effects(document: Mapping[str, Any]) -> Problems:
    for index, effect in enumerate(document["effects"]):
        where = f"effects[{index}]"
        keys = ("name", "location", "equation", "citation", "remedy", "check")
        yield from _texts(effect, keys, where)
        yield from _number(effect, "probability", where, 0.0, 1.0)
        for name, entry in effect["parameters"].items():
            yield from _estimate(entry, f"{where}.parameters.{name}")
        for k, other in enumerate(effect["alternatives"]):
            yield from _texts(other, ("name", "location"), f"{where}.alternatives[{k}]")
            yield from _number(other, "probability", f"{where}.alternatives[{k}]", 0.0, 1.0)
    for index, group in enumerate(document["ambiguous_between"]):
        if len(group) < 2:
            yield f"ambiguous_between[{index}]: fewer than two members"
        for member in group:
            yield from _texts(member, ("name", "location"), f"ambiguous_between[{index}]")


def _located(document: Mapping[str, Any]) -> Problems:
    located = document["located"]
    if located["coordinate"] not in (*COORDINATES, None):
        yield f"located.coordinate: {located['coordinate']!r}"
    if located["state"] not in (*STATES, None):
        yield f"located.state: {located['state']!r}"
    files = {row["recording"] for row in document["fit"]}
    for row in located["time"]:
        if len(row) != 4 or row[0] not in files or not row[1] <= row[2]:
            yield f"located.time: {row!r}, expected [recording, from, to, size]"
    for row in located["path"]:
        if len(row) != 3 or not all(map(_finite, row)):
            yield f"located.path: {row!r}, expected [x, y, size]"
    band = located["frequency"]
    if band is not None and not (len(band) == 2 and 0 <= band[0] <= band[1]):
        yield f"located.frequency: {band!r}"
    yield from _number(located, "confidence", "located", 0.0, 1.0)
    for site in located.get("sites", []):
        if site["location"] not in COORDINATES or not _finite(site["gain"]):
            yield f"located.sites: {site!r}"
        yield from _number(site, "probability", "located.sites", 0.0, 1.0)


def _fit(document: Mapping[str, Any]) -> Problems:
    if not document["fit"]:
        yield "fit: empty"
    for index, row in enumerate(document["fit"]):
        where = f"fit[{index}]"
        yield from _texts(row, ("recording", "channel"), where)
        if row["role"] not in ("train", "holdout"):
            yield f"{where}.role: {row['role']!r}"
        for key in (*RMS, "noise_std"):
            yield from _number(row, key, where, 0.0, math.inf)
        yield from _number(row, "whiteness_p", where, 0.0, 1.0)


def _heldout(document: Mapping[str, Any]) -> Problems:
    heldout = document["heldout"]
    for key in (*RMS, "noise_std"):
        yield from _number(heldout, key, "heldout", 0.0, math.inf)
    if not isinstance(heldout["weak"], bool):
        yield "heldout.weak: not true or false"
    retuned, explained, noise = (
        heldout[key] ** 2 for key in ("rms_retuned", "rms_explained", "noise_std")
    )
    removed = heldout["excess_removed"]
    if removed is None or retuned <= noise:
        return
    expected = (retuned - explained) / (retuned - noise)
    if abs(removed - expected) > 1e-3 * max(1.0, abs(expected)):
        yield f"heldout.excess_removed: {removed}, expected {expected}"


def _retuned(document: Mapping[str, Any]) -> Problems:
    for name, entry in document["retuned"].items():
        where = f"retuned.{name}"
        yield from _estimate(entry, where)
        yield from _number(entry, "pull", where, -math.inf, math.inf)
        if not isinstance(entry["prior_driven"], bool):
            yield f"{where}.prior_driven: not true or false"


def _not_excluded(document: Mapping[str, Any]) -> Problems:
    for index, row in enumerate(document["not_excluded"]):
        where = f"not_excluded[{index}]"
        yield from _texts(row, ("name", "location", "parameter", "unit"), where)
        yield from _number(row, "upper95", where, -math.inf, math.inf)


def _verdict(document: Mapping[str, Any]) -> Problems:
    """What a verdict says about the rest."""
    verdict, effects = document["verdict"], document["effects"]
    heldout = document["heldout"]
    if verdict == "explained" and not effects:
        yield "explained: without effects"
    if verdict == "explained" and math.prod(e["probability"] for e in effects) < DECISIVE - 0.05:
        yield "explained: the set of effects is less probable than 0.95"
    if verdict == "ambiguous" and not document["ambiguous_between"]:
        yield "ambiguous: between what?"
    if verdict == "unexplained" and (not effects or effects[0]["name"] != "free_form"):
        yield "unexplained: effects[0] is not free_form"
    if verdict == "nothing_missing" and effects:
        yield "nothing_missing: with effects"
    gap = abs(heldout["rms_explained"] - heldout["rms_retuned"])
    if verdict == "nothing_missing" and gap > SAME * heldout["rms_retuned"]:
        yield "nothing_missing: rms_explained differs from rms_retuned"


def _estimate(entry: Mapping[str, Any], where: str) -> Problems:
    """A value with unit and interval."""
    yield from _number(entry, "value", where, -math.inf, math.inf)
    yield from _texts(entry, ("unit",), where)
    interval = entry.get("ci95")
    ordered = (
        isinstance(interval, Sequence)
        and len(interval) == 2
        and all(map(_finite, interval))
        and interval[0] <= interval[1]
    )
    if not ordered:
        yield f"{where}.ci95: {interval!r}, expected [lower, upper]"


def _number(entry: Mapping[str, Any], key: str, where: str, lower: float, upper: float) -> Problems:
    if not _finite(entry.get(key)) or not lower <= entry[key] <= upper:
        yield f"{where}.{key}: {entry.get(key)!r}, expected a number".lstrip(".")


def _finite(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and math.isfinite(value)


def _texts(entry: Mapping[str, Any], keys: Sequence[str], where: str) -> Problems:
    if not isinstance(entry, Mapping):
        yield f"{where}: {entry!r}, expected a table"
        return
    for key in keys:
        if not isinstance(entry.get(key), str):
            yield f"{where}.{key}: {entry.get(key)!r}, expected text"
