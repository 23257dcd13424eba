"""A diagnosis on one screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from corexy_fmi.commands.screen import cells, console

COLOURS = {"explained": "green", "nothing_missing": "green", "ambiguous": "yellow"}
WORDS = {
    "explained": "explained: the physics that the model lacks is named, and held-out data agree",
    "ambiguous": "ambiguous: something is missing, and more than one cause, or size, explains it",
    "unexplained": "unexplained: something is missing that no catalogued effect explains",
    "nothing_missing": "nothing missing: after retuning the rest is noise",
}
UNSIZED = (
    "the cause is sure, its size is not: the data kept back show another one; fit them too, and "
    "keep another recording back"
)


def show_verdict(document: Mapping[str, Any]) -> None:
    """Verdict, what is wrong with the recordings, causes and held-out proof; the surrogate's
    assumption first.
    """
    from corexy_fmi.engine.telling.classes import equals, unsized

    screen = console()
    verdict = str(document["verdict"])
    lines = [WORDS.get(verdict, verdict)]
    if document["machine_assumed"]:
        lines.append("no machine file was given: a surrogate was assumed")
    colour = COLOURS.get(verdict, "red")
    screen.print(Panel(Text("\n".join(lines)), title="diagnosis", border_style=colour))
    for found in document.get("findings", ()):
        screen.print(f"{found['text']}. {found['fix']}", style="yellow", markup=False)
    told = [e["description"] for e in document["effects"] if e.get("description")]
    if told:
        screen.print(f"{document['located']['coordinate']}: {told[0]}", markup=False)
    elif document["effects"]:
        screen.print(_effects(document["effects"]))
    alone = unsized(document)
    if alone:
        screen.print(UNSIZED, style="yellow")
    for group in [] if alone else equals(document):
        members = " or ".join(map(_member, group))
        screen.print(f"cannot be told apart: {members}", markup=False)
    screen.print(_proof(document["heldout"]))


def _member(together: Sequence[Mapping[str, Any]]) -> str:
    """One cause, or several that act together."""
    return " with ".join(f"{m['name']} at {m['location']}" for m in together)


def _effects(effects: list[Mapping[str, Any]]) -> Table:
    """What was found, and what to do about it."""
    table = Table("cause", "location", "probability", "parameters", "remedy", "check")
    for effect in effects:
        numbers = "\n".join(
            f"{name} = {_estimate(entry)}" for name, entry in effect["parameters"].items()
        )
        row = (effect["name"], effect["location"], f"{effect['probability']:.3f}", numbers)
        told = (effect.get("remedy", ""), effect.get("check", ""))
        table.add_row(*cells(*row, *told))
    return table


def _estimate(entry: Mapping[str, Any]) -> str:
    """A value with its interval, where data tell it."""
    if entry.get("determined") is False:
        return "undetermined"
    return f"{entry['value']:.4g} {entry['unit']}{_interval(entry)}"


def _interval(entry: Mapping[str, Any]) -> str:
    """The 95 % interval, where there is one."""
    interval = entry.get("ci95")
    return f" [{interval[0]:.4g}, {interval[1]:.4g}]" if interval else ""


def _proof(heldout: Mapping[str, Any]) -> Table:
    """Held-out mismatch: as given, retuned, explained, noise."""
    weak = " (weak: the last 30 % of the recordings)" if heldout.get("weak") else ""
    table = Table("held out" + weak, "rms (SI: m, m/s, m/s^2, rad)")
    for key in ("rms_nominal", "rms_retuned", "rms_explained", "noise_std"):
        value = heldout.get(key)
        table.add_row(key, "none" if value is None else f"{value:.4g}")
    removed = heldout.get("excess_removed")
    table.add_row("excess_removed", "none" if removed is None else f"{removed:.1%}")
    return table
