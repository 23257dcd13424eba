"""``corexy fleet``: every machine of a folder diagnosed, and one table of what they lack."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from corexy_fmi.commands.fleet_task import diagnose_parcel
from corexy_fmi.commands.places import folder_place, keep_apart
from corexy_fmi.commands.screen import (
    DaskOption,
    JobsOption,
    JsonOption,
    cells,
    console,
    cores,
    say,
    say_json,
)
from corexy_fmi.commands.sweep import NOT_ONE
from corexy_fmi.commands.verdict import COLOURS
from corexy_fmi.errors import InputError
from corexy_fmi.files import RESULT_FILES
from corexy_fmi.fleet.cases import find_machines
from corexy_fmi.fleet.run import Told, diagnose_fleet
from corexy_fmi.fleet.store import Store
from corexy_fmi.fleet.table import Row, as_document
from corexy_fmi.machine import load_machine

ASSUMED = "no machine file (*): a surrogate was assumed"


def fleet(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A subfolder for each machine.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="For results; else FOLDER.", parser=folder_place),
    ] = None,
    machine: Annotated[
        str | None, typer.Option(metavar="FILE", help="Where a subfolder has no machine.toml.")
    ] = None,
    jobs: JobsOption = None,
    dask: DaskOption = None,
    as_json: JsonOption = False,
) -> None:
    """Diagnose every machine of a folder; one table of verdicts and causes.

    A subfolder holds recordings (*.csv; holdout*.csv and H1.csv judge, the others train) and
    perhaps machine.toml. Results go to DIR/MACHINE/result, the table to fleet.csv and fleet.json.
    The same command goes on where it was stopped; a subfolder that cannot be read is a row.

    Examples:

    corexy fleet printers

    corexy fleet printers --machine printer.toml --dask 10.0.0.1:8786
    """
    from corexy_fmi.sweep.workers import workers

    if dask is not None and jobs is not None:
        raise InputError(NOT_ONE)
    machines, store = find_machines(folder), Store(folder_place(out or folder))
    if machine is not None:
        load_machine(machine)
        results = [store.place(path.name) / n for path in machines for n in RESULT_FILES]
        keep_apart(results, [], machine)
    with workers(jobs or cores(), dask) as (executor, ahead), _bar(len(machines)) as move:
        rows = diagnose_fleet(machines, machine, store, diagnose_parcel, executor, ahead, move)
    if as_json:
        say_json(as_document(rows))
        return
    console().print(_table(rows))
    if any(row["assumed"] for row in rows):
        say(ASSUMED)
    say(str(store.out / "fleet.csv"))
    say(str(store.out / "fleet.json"))


@contextmanager
def _bar(count: int) -> Iterator[Told]:
    """A bar on stderr that also tells each machine's verdict as it comes."""
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("machines"), TimeElapsedColumn())
    screen = console(stderr=True)
    with Progress(
        *columns, console=screen, transient=True, disable=not screen.is_interactive
    ) as bar:
        task = bar.add_task("machines", total=count)

        def move(row: Row, found: bool) -> None:
            bar.advance(task)
            if screen.is_terminal and not found:
                screen.print(f"{row['machine']}: {row['verdict'] or row['error']}", markup=False)

        yield move


def _table(rows: Sequence[Row]) -> Table:
    """The fleet on one screen; a machine that was assumed has a star."""
    names = ("machine", "verdict", "cause", "place", "probability", "held out", "seconds")
    table = Table(*names)
    for row in rows:
        if row["error"] is not None:
            table.add_row(*cells(row["machine"], "error", row["error"]), style="red")
            continue
        star = " *" if row["assumed"] else ""
        verdict = Text(row["verdict"], style=COLOURS.get(row["verdict"], "red"))
        both = cells(" + ".join(row["causes"]), " + ".join(row["places"]))
        rest = cells(_number(row["probability"], ".3f"), _held(row), f"{row['seconds']:.0f}")
        table.add_row(*cells(row["machine"] + star), verdict, *both, *rest)
    return table


def _held(row: Row) -> str:
    """Mismatch of the data kept back, before and after [SI]."""
    before, after = (_number(row[f"heldout_{n}"], ".3g") for n in ("before", "after"))
    return f"{before} -> {after}" if before else ""


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)
