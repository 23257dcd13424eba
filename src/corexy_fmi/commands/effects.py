"""``corexy effects``: the catalogue of what a model can lack."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from corexy_fmi.commands.screen import JsonOption, cells, console, say, say_json
from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect
from corexy_fmi.errors import InputError
from corexy_fmi.nearest import nearest


def effects(
    name: Annotated[str | None, typer.Argument(help="One effect, in full.")] = None,
    as_json: JsonOption = False,
) -> None:
    """List the catalogue, or show one effect: equation, parameters, places, remedy, check.

    Examples:

    corexy effects

    corexy effects backlash --json
    """
    known = catalogue()
    if name is None:
        _show_all(known, as_json)
    elif name not in known:
        raise InputError(
            f"effects: unknown effect {name!r}, expected one of `corexy effects`"
            f"{nearest(name, known)}"
        )
    elif as_json:
        say_json(describe(known[name]))
    else:
        _show(known[name])


def describe(effect: Effect) -> dict[str, Any]:
    """One effect as plain data."""
    return {
        "name": effect.name,
        "summary": effect.summary,
        "equation": effect.equation,
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit_anywhere,
                "meaning": p.meaning,
                "neutral": p.neutral,
                "lower": p.lower,
                "upper": p.upper,
                "default": p.default,
            }
            for p in effect.parameters
        ],
        "locations": list(effect.locations),
        "drives": list(effect.drives),
        "fidelities": list(effect.fidelities),
        "state": effect.state,
        "looks_like": effect.looks_like,
        "citation": effect.citation,
        "remedy": effect.remedy,
        "check": effect.check,
    }


def _show_all(known: dict[str, Effect], as_json: bool) -> None:
    """One row for each effect."""
    if as_json:
        say_json([describe(effect) for effect in known.values()])
        return
    table = Table("effect", "what the model leaves out", "location", "parameters")
    for effect in known.values():
        units = ", ".join(f"{p.name} ({p.unit_anywhere})" for p in effect.parameters)
        table.add_row(*cells(effect.name, effect.summary, ", ".join(effect.locations), units))
    console().print(table)


def _show(effect: Effect) -> None:
    """One effect, line by line."""
    say(f"{effect.name}: {effect.summary}")
    table = Table("parameter", "unit", "neutral", "from", "to", "meaning")
    for p in effect.parameters:
        numbers = (f"{number:g}" for number in (p.neutral, p.lower, p.upper))
        table.add_row(*cells(p.name, p.unit_anywhere, *numbers, p.meaning))
    console().print(table)
    for what, text in (
        ("equation", effect.equation),
        ("locations", ", ".join(effect.locations)),
        ("drives", ", ".join(effect.drives)),
        ("fidelities", ", ".join(effect.fidelities)),
        ("looks like", effect.looks_like),
        ("citation", effect.citation),
        ("remedy", effect.remedy),
        ("check", effect.check),
    ):
        say(f"{what}: {text}")
