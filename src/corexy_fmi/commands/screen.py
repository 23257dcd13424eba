"""What the commands share: the screen, the surrogate's label, progress."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from corexy_fmi.commands.streams import encodes_all
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording, is_dc

MachineOption = Annotated[
    str,
    typer.Option("--machine", metavar="FILE", help="Machine file, or the name of a bundled one."),
]
EffectsOption = Annotated[
    Path | None,
    typer.Option("--effects", metavar="FILE", help="Python file with an effect of your own."),
]
JobsOption = Annotated[int | None, typer.Option(min=1, help="Workers; else one a core.")]
DaskOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler, host:port.")
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print JSON on stdout, and nothing else there.")
]
ASSUMED = "yin2018"
WIDTH = 120  # [characters] where there is no terminal


def console(*, stderr: bool = False) -> Console:
    """The screen; without a terminal its lines are wide, so that paths stay whole."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, highlight=False, width=None if stream.isatty() else WIDTH)


def cells(*texts: object) -> list[Text]:
    """Cells of a table whose brackets stay brackets."""
    return [Text(str(text)) for text in texts]


def say(line: str) -> None:
    """One line on stdout, unwrapped."""
    console().print(line, markup=False, soft_wrap=True)


def say_json(document: Any) -> None:
    """The document on stdout; NaN and infinity are no JSON and must not be in it."""
    print(json.dumps(document, indent=1, ensure_ascii=not encodes_all(), allow_nan=False))


def label(machine: Machine) -> None:
    """Say that a machine's numbers are a surrogate, where they are."""
    if machine.surrogate:
        say(f"machine {machine.name}: {machine.surrogate}")


def assumed_machine(recordings: Sequence[Recording]) -> str:
    """Name of the surrogate with the recordings' drive, for a call that names no machine."""
    return f"{ASSUMED}_dc" if all(is_dc(recording) for recording in recordings) else ASSUMED


def provenance(machine: Machine, plant: str) -> dict[str, str]:
    """Metadata of a simulated recording."""
    about = {"machine": machine.name, "plant": plant}
    return about | ({"surrogate": machine.surrogate} if machine.surrogate else {})


@contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """A bar on stderr; gives the function that moves it: what is done, and its share, 0 to 1.

    Where stderr is no terminal there is none.
    """
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    screen = console(stderr=True)
    with Progress(
        *columns, console=screen, transient=True, disable=not screen.is_interactive
    ) as bar:
        task = bar.add_task("reading", total=1.0)

        def move(what: str, share: float) -> None:
            bar.update(task, description=what, completed=share)

        yield move


def point(text: str, what: str) -> tuple[float, float]:
    """A place [m] out of an option's text; raises InputError for what is not two finite numbers."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InputError(f"{what}: found {text!r}, expected two numbers in m such as 0.1,0.125")
    return x, y


def cores() -> int:
    """Cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
