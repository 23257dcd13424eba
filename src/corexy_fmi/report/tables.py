"""The tables of the report: headers and cells as text, ready to be escaped and set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from corexy_fmi.engine.evidence import Evidence
from corexy_fmi.report.quantities import (
    NOTHING,
    channel_label,
    channel_unit,
    number,
    percent,
    quantity,
    with_interval,
)
from corexy_fmi.report.units import heldout_unit
from corexy_fmi.report.words import cause, effect_name, place, sentence

Document = Mapping[str, Any]
LIMIT = 300  # rows of one table; more is told in its caption


@dataclass(frozen=True)
class Table:
    """A caption, headers (a leading ``>`` sets a column of numbers) and rows of cells.

    ``bars`` holds a share 0 .. 1 for each row, drawn under its first number.
    """

    caption: str
    headers: Sequence[str]
    rows: Sequence[Sequence[str]]
    bars: Sequence[float] = ()


def _table(
    caption: str, headers: Sequence[str], rows: Sequence[Sequence[str]], bars: Sequence[float] = ()
) -> Table:
    """A table that keeps its length in bounds and says so."""
    if len(rows) > LIMIT:
        caption = f"{caption} The first {LIMIT} of {len(rows)} rows; all are in diagnosis.json."
    return Table(caption, headers, rows[:LIMIT], bars[:LIMIT])


def parameters(document: Document) -> Table:
    """Parameters of the named effects with their intervals."""
    rows = []
    for effect in document.get("effects") or []:
        for name, entry in (effect.get("parameters") or {}).items():
            value, interval = with_interval(
                entry["value"], entry.get("ci95"), entry.get("unit", "")
            )
            if entry.get("determined") is False:
                value, interval = "undetermined", f"{interval}: its whole range"
            rows.append((sentence(cause(effect)), words(name), value, interval))
    return _table(
        "Parameters of the named effects.",
        ("effect", "parameter", ">value", ">95 % interval"),
        rows,
    )


def retuned(document: Document) -> Table:
    """Retuned parameters of the machine with intervals; the pull chart stands beside it."""
    rows = []
    for name, entry in (document.get("retuned") or {}).items():
        value, interval = with_interval(entry["value"], entry.get("ci95"), entry.get("unit", ""))
        source = "prior" if entry.get("prior_driven") else "data"
        rows.append((words(name), value, interval, source))
    return _table(
        "Retuned machine parameters.", ("parameter", ">value", ">95 % interval", "decided by"), rows
    )


def runners_up(document: Document, evidence: Evidence) -> Table:
    """The competition, best first."""
    unit, scale = heldout_unit(document)
    rows: list[Sequence[str]] = []
    for r in evidence.runners_up:
        rms = quantity(r.heldout_rms * scale, unit) if r.heldout_rms is not None else NOTHING
        label = sentence(cause({"name": r.name, "location": r.location}))
        rows.append((label, percent(r.probability), number(r.gain), rms, r.note))
    headers = ("hypothesis", ">probability", ">gain [nats]", ">held-out rms", "note")
    told = [
        i
        for i, _ in enumerate(headers)
        if i < 3 or any(row[i] not in ("", NOTHING) for row in rows)
    ]
    rows = [[row[i] for i in told] for row in rows]  # a column of dashes helps nobody
    caption = "Log evidence gained over the retuned machine."
    chances = [r.probability for r in evidence.runners_up]
    return _table(caption, [headers[i] for i in told], rows, chances)


def sites(document: Document) -> Table:
    """Where simple laws would explain an unexplained mismatch, the best place first."""
    told = (document.get("located") or {}).get("sites") or []
    rows = [
        (sentence(place(s["location"])), number(s["gain"]), s["word"])
        for s in told
        if document.get("verdict") == "unexplained"
    ]
    caption = "What simple laws at a place gain over the retuned machine, and the best of them."
    chances = [s["probability"] for s in told][: len(rows)]
    return _table(caption, ("place", ">gain [nats]", "best law there"), rows, chances)


def not_excluded(document: Document) -> Table:
    """How large each effect that was not named could be."""
    rows = [(sentence(cause(r)), *_bound(r)) for r in document.get("not_excluded") or []]
    caption = "Effects that were not named could still be as large as this (95 %)."
    return _table(caption, ("effect", "parameter", ">at most"), rows)


def _bound(entry: Mapping[str, Any]) -> tuple[str, str]:
    """A parameter and its bound; what vanishes at infinity has its inverse bounded, and is told as
    itself.
    """
    name, unit, most = entry.get("parameter", ""), entry.get("unit", ""), entry.get("upper95")
    if name.startswith("1/") and most:
        inside = unit.removeprefix("1/(").removesuffix(")")
        return words(name.removeprefix("1/")), f"at least {quantity(1 / most, inside)}"
    return words(name), quantity(most, unit)


def fits(document: Document) -> Table:
    """Root mean square mismatch of each recording and channel."""
    rows = []
    for r in document.get("fit") or []:
        unit = channel_unit(r.get("channel", ""))
        sizes = [
            quantity(r.get(k), unit)
            for k in ("rms_nominal", "rms_retuned", "rms_explained", "noise_std")
        ]
        role = "held out" if r.get("role") == "holdout" else "training"
        white = number(r.get("whiteness_p"), 2)
        rows.append(
            (r.get("recording", ""), role, channel_label(r.get("channel", "")), *sizes, white)
        )
    headers = (
        "recording",
        "role",
        "channel",
        ">as given",
        ">retuned",
        ">explained",
        ">noise",
        ">whiteness p",
    )
    return _table("Mismatch of each recording and channel, rms.", headers, rows)


def alternatives(document: Document) -> list[str]:
    """What else could stand in each named effect's place, in words."""
    told = []
    for effect in document.get("effects") or []:
        others = [
            f"{cause(a)} ({percent(a.get('probability'))})"
            for a in effect.get("alternatives") or []
        ]
        if others:
            told.append(f"Instead of {effect_name(effect.get('name', ''))}: {', '.join(others)}.")
    return told


def words(name: str) -> str:
    """``carriage_mass`` as carriage mass; ``time@file`` keeps its file."""
    parameter, at, recording = str(name).partition("@")
    told = parameter.replace("_", " ").replace("coulomb", "Coulomb")
    return told + (f" ({recording})" if at else "")
