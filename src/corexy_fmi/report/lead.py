"""What the report says first: cause, place, size, what to do; one text for each verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from corexy_fmi.engine.evidence import Evidence
from corexy_fmi.engine.telling.classes import equals, unsized
from corexy_fmi.report.notices import above_noise
from corexy_fmi.report.quantities import millimetres, percent, quantity
from corexy_fmi.report.sentences import (
    Action,
    corner_sentence,
    gain_sentence,
    known,
    next_experiment,
    remedies,
    worth_telling,
)
from corexy_fmi.report.units import heldout_unit
from corexy_fmi.report.words import STATES, cause, effect_name, full_stop, listed, place, sentence

Document = Mapping[str, Any]
MEMBERS = 3  # causes that a headline can name


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
    corner = worth_telling(evidence.corner)
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
        (*corner_sentence(corner, "them" if many else "it"), *gain_sentence(document)),
        tuple(remedies(document)),
        tuple(facts),
    )


def _ambiguous(document: Document, evidence: Evidence) -> Lead:
    """The causes that explain the data equally well, and the experiment that would decide."""
    if unsized(document):
        return _unsized(document)
    named = [member for group in classes(document) for member in group]
    if 1 < len(named) <= MEMBERS:
        headline = f"{listed(named, 'or')}: these recordings cannot tell which."
    else:
        headline = f"One of {len(named) or 'several'} causes; these recordings cannot tell which."
    said = (
        "The model leaves something out, and each of these causes explains the recordings "
        "as well as the others."
    )
    best = remedies(document, "If it is ")
    corner = corner_sentence(worth_telling(evidence.corner), "the effect")
    actions = (*next_experiment(document), *best)
    return Lead("Ambiguous", sentence(headline), (said, *corner, *gain_sentence(document)), actions)


def _unsized(document: Document) -> Lead:
    """The cause, and that recordings ask for different sizes of it."""
    effects = document.get("effects") or []
    causes, many = listed(cause(e) for e in effects), len(effects) > 1
    left, it = ("were left", "they are") if many else ("was left", "it is")
    headline = f"{causes} {left} out of the simulation; how large {it} remains open."
    said = (
        "The data that were kept back ask for another size than the data that were fitted told; "
        "with that they agree."
    )
    record = Action(
        "Next experiment",
        "Fit what was kept back too, and keep another recording back.",
        "Where the size differs again, the effect changes, or its law is only nearly right.",
    )
    lines = (said, *gain_sentence(document))
    return Lead("Ambiguous", sentence(headline), lines, (record, *remedies(document)))


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
    corner = corner_sentence(worth_telling(evidence.corner), missing)
    actions = (*next_experiment(document), law) if evidence.laws else next_experiment(document)
    return Lead(
        "Unexplained", headline, (*filter(None, said), *corner, *gain_sentence(document)), actions
    )


def _nothing_missing(document: Document, evidence: Evidence) -> Lead:
    """The rest is noise; small effects may still hide below their bounds."""
    held = document.get("heldout") or {}
    unit, scale = heldout_unit(document)
    said = []
    if known(held, "rms_retuned", "noise_std"):
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
    """The classes of equals in words; a lone member stands against the retuned parameters, unless
    only its size is not sure.
    """
    told: list[list[str]] = []
    for group in [] if unsized(document) else equals(document):
        members = [_member(member) for member in group]
        told.append(members if len(members) != 1 else [*members, effect_name("retuned_parameters")])
    return told


def _member(together: Sequence[Mapping[str, Any]]) -> str:
    """One cause, or several that act together."""
    return " with ".join(map(cause, together))
