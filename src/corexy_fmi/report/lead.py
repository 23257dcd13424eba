"""What the report says first: cause, place, size, what to do; one text for each verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from corexy_fmi.engine.evidence import CornerSize, Evidence
from corexy_fmi.engine.telling.classes import equals
from corexy_fmi.report.notices import above_noise
from corexy_fmi.report.quantities import millimetres, percent, quantity
from corexy_fmi.report.units import heldout_unit
from corexy_fmi.report.words import STATES, cause, effect_name, full_stop, listed, place, sentence

Document = Mapping[str, Any]
MEMBERS = 3  # causes that a headline can name
SEEN = 1.01  # rms over noise, below which what is removed of the difference says nothing
VISIBLE = 5e-4  # [mm] below which a corner's change is not worth a headline


@dataclass(frozen=True)
class Action:
    """One thing to do on the machine, and how to confirm it by hand."""

    title: str
    do: str
    check: str = ""


@dataclass(frozen=True)
class Lead:
    """The first screen in words."""

    badge: str
    headline: str
    sentences: tuple[str, ...]
    actions: tuple[Action, ...] = ()
    facts: tuple[tuple[str, str], ...] = field(default=())


def make_lead(document: Document, evidence: Evidence) -> Lead:
    """The lead of a verdict; an unknown verdict is told as unexplained."""
    texts = {"explained": _explained, "ambiguous": _ambiguous, "nothing_missing": _nothing_missing}
    return texts.get(document.get("verdict", ""), _unexplained)(document, evidence)


def _explained(document: Document, evidence: Evidence) -> Lead:
    """Cause and place, the corner with and without, the remedy of each effect."""
    effects = document.get("effects") or []
    causes, many = listed(cause(e) for e in effects), len(effects) > 1
    corner = _worth_telling(evidence.corner)
    headline = f"{causes} {'are' if many else 'is'} what the simulation left out."
    if corner:
        change = millimetres(corner.with_effect_mm - corner.without_effect_mm)
        together = "together shift" if many else "shifts"
        headline = f"{causes} {together} the path by {change} at the corner."
    chances = [e["probability"] for e in effects if e.get("probability") is not None]
    facts = [("probability", percent(min(chances, default=None)))]
    return Lead(
        "Explained",
        sentence(headline),
        (*_corner_sentence(corner, "them" if many else "it"), *_gain_sentence(document)),
        tuple(
            Action(sentence(cause(e)), full_stop(e.get("remedy")), full_stop(e.get("check")))
            for e in effects
        ),
        tuple(facts),
    )


def _ambiguous(document: Document, evidence: Evidence) -> Lead:
    """The causes that explain the data equally well, and the experiment that would decide."""
    named = [member for group in classes(document) for member in group]
    if 1 < len(named) <= MEMBERS:
        headline = f"{listed(named, 'or')}: these recordings cannot tell which."
    else:
        headline = f"One of {len(named) or 'several'} causes; these recordings cannot tell which."
    said = (
        "The model leaves something out, and each of these causes explains the recordings "
        "as well as the others."
    )
    best = [
        Action(f"If it is {cause(e)}", full_stop(e.get("remedy")), full_stop(e.get("check")))
        for e in document.get("effects") or []
    ]
    corner = _corner_sentence(_worth_telling(evidence.corner), "the effect")
    actions = (*_next_experiment(document), *best)
    return Lead(
        "Ambiguous", sentence(headline), (said, *corner, *_gain_sentence(document)), actions
    )


def _unexplained(document: Document, evidence: Evidence) -> Lead:
    """Where something is missing, in words, and that nothing known fits."""
    located = document.get("located") or {}
    where = place(located.get("coordinate"))
    headline = f"Something is missing {where}".strip() + ", and no known cause fits it."
    effects = document.get("effects") or []
    said = [full_stop(sentence(e.get("description") or "")).replace("+-", "±") for e in effects]
    shows = STATES.get(located.get("state") or "")
    if shows:
        said.insert(
            0, f"The mismatch goes {shows}." if shows.startswith("with") else f"It shows {shows}."
        )
    missing = f"the missing {evidence.laws[0].acts if evidence.laws else 'force'}"
    law = Action(
        "Read the law below",
        f"It shows {missing} against the variable it depends on. "
        "If you recognise its shape, describe it as an effect and diagnose again.",
    )
    corner = _corner_sentence(_worth_telling(evidence.corner), missing)
    actions = (*_next_experiment(document), law) if evidence.laws else _next_experiment(document)
    return Lead(
        "Unexplained", headline, (*filter(None, said), *corner, *_gain_sentence(document)), actions
    )


def _nothing_missing(document: Document, evidence: Evidence) -> Lead:
    """The rest is noise; small effects may still hide below their bounds."""
    held = document.get("heldout") or {}
    unit, scale = heldout_unit(document)
    said = []
    if _known(held, "rms_retuned", "noise_std"):
        rms, noise = (quantity(held[k] * scale, unit) for k in ("rms_retuned", "noise_std"))
        said.append(
            f"What the retuned model leaves is {rms} rms; the noise of the recordings is {noise}."
        )
    if document.get("not_excluded"):
        said.append("Effects smaller than the bounds listed below cannot be excluded.")
    action = Action("Nothing to tighten", "Use the retuned machine for simulation and control.")
    headline = "Nothing is missing: after retuning, the rest is noise."
    if above_noise(held):
        headline = "No missing effect was found, but what is left stands above the noise."
    return Lead("Nothing missing", headline, tuple(said), (action,))


def classes(document: Document) -> list[list[str]]:
    """The classes of equals in words; a lone member stands against the retuned parameters."""
    told = []
    for group in equals(document):
        members = [_member(member) for member in group]
        told.append(members if len(members) != 1 else [*members, effect_name("retuned_parameters")])
    return told


def _member(together: Sequence[Mapping[str, Any]]) -> str:
    """One cause, or several that act together."""
    return " with ".join(map(cause, together))


def _worth_telling(corner: CornerSize | None) -> CornerSize | None:
    """The corner, where the effect changes it visibly."""
    if corner is None or not abs(corner.with_effect_mm - corner.without_effect_mm) >= VISIBLE:
        return None
    return corner


def _corner_sentence(corner: CornerSize | None, it: str) -> tuple[str, ...]:
    """How far the path misses the corner with and without the effect."""
    if corner is None:
        return ()
    now, then = (millimetres(v) for v in (corner.with_effect_mm, corner.without_effect_mm))
    told = f"With {it} the path misses the corner by {now}, without {it} by {then}"
    return (f"{told} ({corner.recording}).",)


def seen(held: Mapping[str, Any]) -> bool:
    """Whether the held-out mismatch of the retuned machine stands out of the noise as an rms."""
    return _known(held, "rms_retuned", "noise_std") and bool(
        held["rms_retuned"] >= SEEN * held["noise_std"]
    )


def _gain_sentence(document: Document) -> tuple[str, ...]:
    """How far the held-out mismatch falls."""
    held = document.get("heldout") or {}
    if not _known(held, "rms_retuned", "rms_explained", "noise_std"):
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
    return (
        f"On data kept out of the fit the mismatch falls from {before} to {after}; "
        f"noise alone is {noise}.",
    )


def _next_experiment(document: Document) -> tuple[Action, ...]:
    """The experiment that would decide, if there is one."""
    plan = document.get("next_experiment") or {}
    if not plan.get("why"):
        return ()
    program = f"Run the program {plan['program']}." if plan.get("program") else ""
    return (Action("Next experiment", full_stop(sentence(plan["why"])), program),)


def _known(table: Mapping[str, Any], *keys: str) -> bool:
    """Whether all of these hold a number."""
    return all(isinstance(table.get(k), int | float) and math.isfinite(table[k]) for k in keys)
