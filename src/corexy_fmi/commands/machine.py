"""``corexy machine new``: a machine file out of a printer's configuration, or by questions."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from corexy_fmi.commands.places import file_place, keep_apart
from corexy_fmi.commands.screen import cells, console, say
from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.machine.belts import BELTS, USUAL, belt
from corexy_fmi.machine.new import NEEDED, Line, Told, facts_of, lines, machine_text, notes_of
from corexy_fmi.machine.printer import read_printer
from corexy_fmi.parameters import NOMINAL

app = typer.Typer(no_args_is_help=True)
QUANTITY = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(m|mm|kg|g|N)?\s*")
UNITS = {"m": ("m", 1.0), "mm": ("m", 1e-3), "kg": ("kg", 1.0), "g": ("kg", 1e-3), "N": ("N", 1.0)}
LARGEST = {"m": 10.0, "kg": 200.0, "N": 1e7}
QUESTIONS = {
    "rotation_distance": ("m", "Belt that one turn of a motor pulls (20 teeth of 2 mm: 40 mm)"),
    "travel_x": ("m", "Way of x"),
    "travel_y": ("m", "Way of y"),
    "belt": ("", f"Belt: {', '.join(BELTS)}, or A E such as 19400 N"),
    "belt_width": ("m", "Width of the belt (6 mm)"),
    "carriage_mass": ("kg", "Mass of the carriage with its tool"),
    "bridge_mass": ("kg", "Mass of the bridge, without carriage and pulleys"),
    "bridge_pulley_spacing": ("m", "W, spacing of the bridge's pulleys in x"),
    "motor_idler_span": ("m", "H, motor to far idler in y"),
    "clip_spacing": ("m", "c, belt clip to belt clip on the carriage"),
}


@app.callback()
def machines() -> None:
    """Machine files.

    Examples:

    corexy machine new --from printer.cfg --belt gt2-glass --out machine.toml
    """


@app.command("new")
def new(
    out: Annotated[
        Path,
        typer.Option(metavar="FILE.toml", help="Where the machine file goes.", parser=file_place),
    ],
    from_: Annotated[
        Path | None, typer.Option("--from", metavar="printer.cfg", help="Klipper's configuration.")
    ] = None,
    rotation_distance: Annotated[
        str, typer.Option(metavar="L", help=QUESTIONS["rotation_distance"][1])
    ] = "",
    travel_x: Annotated[str, typer.Option(metavar="L", help="Way of x.")] = "",
    travel_y: Annotated[str, typer.Option(metavar="L", help="Way of y.")] = "",
    belt_: Annotated[
        str, typer.Option("--belt", metavar="TYPE", help=f"{', '.join(BELTS)}, or A E in N.")
    ] = "",
    belt_width: Annotated[str, typer.Option(metavar="L", help="Width of the belt.")] = "",
    carriage_mass: Annotated[str, typer.Option(metavar="M", help="With its tool.")] = "",
    bridge_mass: Annotated[
        str, typer.Option(metavar="M", help="Without carriage and pulleys.")
    ] = "",
    bridge_pulley_spacing: Annotated[str, typer.Option(metavar="L", help="W.")] = "",
    motor_idler_span: Annotated[str, typer.Option(metavar="L", help="H.")] = "",
    clip_spacing: Annotated[str, typer.Option(metavar="L", help="c.")] = "",
    name: Annotated[str, typer.Option(help="Name of the machine; without: of the file.")] = "",
    ask: Annotated[
        bool | None,
        typer.Option("--ask/--no-ask", help="Ask for the rest; so without --from."),
    ] = None,
) -> None:
    """Write a machine file for your stage; what nobody tells is guessed, marked, with wide priors.

    Values are in m, kg and N, or with a unit, such as "40 mm". An empty answer leaves a guess.

    Examples:

    corexy machine new --from printer.cfg --belt gt2-glass --belt-width "6 mm" --out machine.toml

    corexy machine new --out machine.toml
    """
    given = {
        "rotation_distance": rotation_distance, "travel_x": travel_x, "travel_y": travel_y,
        "belt": belt_, "belt_width": belt_width, "carriage_mass": carriage_mass,
        "bridge_mass": bridge_mass, "bridge_pulley_spacing": bridge_pulley_spacing,
        "motor_idler_span": motor_idler_span, "clip_spacing": clip_spacing,
    }  # fmt: skip
    keep_apart([out], [from_])
    printer = None if from_ is None else read_printer(from_)
    facts = {} if printer is None else facts_of(printer)
    answers = {key: (text, "told on the command line") for key, text in given.items() if text}
    if ask if ask is not None else printer is None:
        answers |= _asked([k for k in QUESTIONS if k not in answers and k not in facts])
    facts |= _facts(answers)
    found = lines(facts)
    notes = [f"Written by corexy machine new{f' from {from_.name}' if from_ else ''}."]
    notes += notes_of(printer) if printer else []
    text = machine_text(name or out.stem, found, notes)
    with write_beside(out) as beside:
        beside.write_text(text, encoding="utf-8", newline="\n")
    _show(found, out, (facts["travel_x"].value, facts["travel_y"].value))


def _asked(keys: list[str]) -> dict[str, tuple[str, str]]:
    """Answers to the questions of these keys, those that were given; the end of stdin ends them."""
    answers = {}
    for key in keys:
        unit, question = QUESTIONS[key]
        tail = (f" [{unit}]" if unit else "") + ("" if key in NEEDED else "; empty: guess")
        print(f"{question}{tail}: ", end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if line.strip():
            answers[key] = line.strip(), "answered"
        elif not line:
            break
    return answers


def _facts(answers: Mapping[str, tuple[str, str]]) -> dict[str, Told]:
    """Numbers in SI units; the belt becomes its A E."""
    facts = {
        key: Told(_quantity(text, QUESTIONS[key][0], key), source)
        for key, (text, source) in answers.items()
        if not key.startswith("belt")
    }
    if not {"belt", "belt_width"} & set(answers):
        return facts
    kind, source = answers.get("belt", (USUAL, ""))
    if QUANTITY.fullmatch(kind):
        return facts | {"belt_axial_stiffness": Told(_quantity(kind, "N", "belt"), source)}
    wide, told = answers.get("belt_width", ("6 mm", ""))
    width = _quantity(wide, "m", "belt_width")
    known = belt(kind)
    why = f"{known.source}, {1e3 * width:g} mm wide"
    sure = bool(source and told)
    return facts | {"belt_axial_stiffness": Told(known.stiffness(width), why, not sure)}


def _quantity(text: str, unit: str, key: str) -> float:
    """A number above 0 in SI units, with or without its unit."""
    found = QUANTITY.fullmatch(text)
    base, factor = UNITS.get((found[2] if found else None) or unit, ("", 1.0))
    try:
        value = float(found[1]) if found and base == unit else 0.0
    except ValueError:
        value = 0.0
    if not 0 < value * factor <= LARGEST[unit]:
        like = {"m": "0.04 or '40 mm'", "kg": "0.5 or '500 g'", "N": "19400"}[unit]
        raise InputError(
            f"{key.replace('_', ' ')}: found {text!r}, expected a number above 0 and at most "
            f"{LARGEST[unit]:g} [{unit}], such as {like}"
        )
    return value * factor


def _show(found: Mapping[str, Line], out: Path, ways: tuple[float, float]) -> None:
    """What is told and what is guessed, and a first command."""
    table = Table("parameter", "value", "unit", "prior", "from")
    for p in NOMINAL:
        line = found[p.name]
        mark = f"GUESS, {line.source}" if line.guessed else line.source
        prior = f"{100 * line.rel_std:g} %" if line.rel_std else "fixed"
        table.add_row(*cells(p.name, f"{line.value:.6g}", p.unit, prior, mark))
    console().print(table)
    say(f"machine: {out}")
    width, height = (min(0.06, way / 2) for way in ways)
    say(
        f"next: corexy rectangle --width {width:.3g} --height {height:.3g} --speed 0.05 "
        f"--machine {out} --out rectangle.csv"
    )
