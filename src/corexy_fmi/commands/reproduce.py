"""``corexy reproduce``: the paper's figures and claims, run again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from corexy_fmi.commands.places import folder_place
from corexy_fmi.commands.screen import (
    ASSUMED,
    JsonOption,
    cells,
    console,
    progress,
    say,
    say_json,
)
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.nearest import nearest

if TYPE_CHECKING:
    from corexy_fmi.reproduce.result import Result

app = typer.Typer(help="The figures and claims of the paper, run again.", no_args_is_help=True)
Report = Callable[[str, float], None]
SetOption = Annotated[
    str,
    typer.Option("--machine", metavar="NAME", help="yin2018 (P1), light_bench (P0), gt2_printer."),
]
OutOption = Annotated[
    Path,
    typer.Option(metavar="DIR", help="Folder for JSON, Markdown and SVG.", parser=folder_place),
]
OUT = Path("reproduced")


@app.command("fig3")
def fig3(
    machine: SetOption = ASSUMED,
    loops: Annotated[int, typer.Option(help="How often around.")] = 20,
    out: OutOption = OUT,
    as_json: JsonOption = False,
) -> None:
    """Fig. 3: rectangles at three speeds, ideal, 4-DoF and full, through the FMU.

    Examples:

    corexy reproduce fig3 --loops 20 --out reproduced
    """
    from corexy_fmi.reproduce.fig3 import fig3 as run

    chosen = _machine(machine)
    _finish(lambda report: run(chosen, loops, report), out, as_json)


@app.command("fig4")
def fig4(machine: SetOption = ASSUMED, out: OutOption = OUT, as_json: JsonOption = False) -> None:
    """Fig. 4: contour error against speed, both turns, all models, straight lines, through the FMU.

    Examples:

    corexy reproduce fig4 --machine light_bench --out reproduced
    """
    from corexy_fmi.reproduce.fig4 import fig4 as run

    chosen = _machine(machine)
    _finish(lambda report: run(chosen, report), out, as_json)


@app.command("fig5")
def fig5(machine: SetOption = ASSUMED, out: OutOption = OUT, as_json: JsonOption = False) -> None:
    """Fig. 5: contour error against relative mass, stiffness and friction, through the FMU.

    Examples:

    corexy reproduce fig5 --out reproduced
    """
    from corexy_fmi.reproduce.fig5 import fig5 as run

    chosen = _machine(machine)
    _finish(lambda report: run(chosen, report), out, as_json)


@app.command("claims")
def claims(
    sets: Annotated[int, typer.Option(help="Parameter sets to draw; 0: only P1, P0, P2.")] = 2000,
    seed: Annotated[int, typer.Option(help="Of the draws.", min=0)] = 0,
    out: OutOption = OUT,
    as_json: JsonOption = False,
) -> None:
    """The claims (a)-(f): held or not on P1, P0 and P2, and in which share of drawn sets.

    Examples:

    corexy reproduce claims --sets 2000 --out reproduced
    """
    from corexy_fmi.reproduce.claimed import claims as run

    _finish(lambda report: run(sets, seed, report), out, as_json)


def _machine(name: str) -> Machine:
    """A set that the paper's claims are stated for; raises InputError for any other."""
    from corexy_fmi.reproduce.paper import SETS, bundled

    chosen = {**{value: value for value in SETS.values()}, **SETS}.get(name)
    if chosen is None:
        known = sorted(SETS.values())
        raise InputError(
            f"machine: found {name!r}, expected one of {', '.join(known)}{nearest(name, known)}"
        )
    return bundled(chosen)


def _finish(run: Callable[[Report], Result], out: Path, as_json: bool) -> None:
    """Run with a bar, write, and say what came out."""
    from corexy_fmi.reproduce.result import write_result

    with progress() as move:
        result = run(move)
    written = write_result(result, out)
    if as_json:
        say_json(result.document())
        return
    say(result.title)
    say(result.label)
    _show(result)
    for path in written:
        say(f"written: {path}")


def _show(result: Result) -> None:
    """Every table on the screen."""
    from corexy_fmi.reproduce.result import shown

    for table in result.tables:
        if not table.rows:
            continue
        screen = Table(*table.head, title=table.title, title_justify="left")
        for record in table.records():
            screen.add_row(*cells(*(shown(cell) for cell in record.values())))
        console().print(screen)
    for note in result.notes:
        say(f"- {note}")
