"""``corexy sweep``: many parameter sets of one rectangle, kept as Parquet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from corexy_fmi.commands.places import folder_place
from corexy_fmi.commands.screen import (
    ASSUMED,
    DaskOption,
    JobsOption,
    JsonOption,
    MachineOption,
    console,
    cores,
    label,
    say,
    say_json,
)
from corexy_fmi.errors import InputError
from corexy_fmi.files import alone_in
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import check_kind
from corexy_fmi.rectangle import Rectangle

NOT_ONE = "dask: found with --jobs, expected one of them"


def sweep(
    width: Annotated[float, typer.Option(help="Size in x [m].")],
    height: Annotated[float, typer.Option(help="Size in y [m].")],
    speed: Annotated[float, typer.Option(help="Speed along the path [m/s].")],
    sets: Annotated[int, typer.Option(help="How many parameter sets.")],
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for them.", parser=folder_place),
    ],
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW:HIGH[:log]",
            help="A number drawn between two, uniform or log-uniform, in its SI unit.",
        ),
    ] = None,
    spread: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=FACTOR", help="Log-uniform, the machine's value / FACTOR to * FACTOR."
        ),
    ] = None,
    machine: MachineOption = ASSUMED,
    loops: Annotated[int, typer.Option(help="How often around.")] = 1,
    accel: Annotated[
        float | None, typer.Option(help="Trapezoid on every side [m/s^2]; without: constant speed.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the draws.", min=0)] = 0,
    chunk: Annotated[int, typer.Option(help="Sets of one task and one file.")] = 4096,
    within: Annotated[float, typer.Option(help="Settled this near to the last place [m].")] = 1e-5,
    jobs: JobsOption = None,
    dask: DaskOption = None,
    as_json: JsonOption = False,
) -> None:
    """Drive one rectangle with many drawn parameter sets; one row for each set, as Parquet.

    KEY is a name of [parameters] or effect.location.parameter (see corexy effects). Columns: set,
    what was drawn, contour error and overshoot (worst of each turn, m), settling (s). The same
    command goes on where it was stopped; its results do not depend on the number of workers.

    Examples:

    corexy sweep --width 0.06 --height 0.04 --speed 0.1 --sets 100000 --vary
    belt_axial_stiffness=500:2000:log --vary backlash.motor1.gap=0:0.02 --out swept

    corexy sweep --width 0.06 --height 0.04 --speed 0.1 --sets 1000000 --spread carriage_mass=2
    --dask 10.0.0.1:8786 --out swept
    """
    from corexy_fmi.sweep.folder import Folder
    from corexy_fmi.sweep.parquet import pyarrow
    from corexy_fmi.sweep.plan import Plan
    from corexy_fmi.sweep.run import sweep as run
    from corexy_fmi.sweep.vary import read_ranges
    from corexy_fmi.sweep.workers import workers

    if dask is not None and jobs is not None:
        raise InputError(NOT_ONE)
    shape = Rectangle(width, height, speed, loops, accel)
    ranges, chosen = read_ranges(vary or (), spread or (), check_kind(load_machine(machine)))
    plan = Plan(chosen, shape, ranges, sets, seed, chunk, within)
    about = {"machine": chosen.name, "surrogate": chosen.surrogate}
    pyarrow()
    folder = Folder(out, plan.document(), about)
    folder.check()  # before a lock is put into somebody else's folder
    with workers(jobs or cores(), dask) as (executor, ahead), alone_in(out):
        done = folder.open()
        before = sum(len(plan.rows(index)) for index in done)
        with _bar(sets, before) as report:
            run(plan, folder, done, executor, ahead, report)
    told = {"machine": chosen.name, "surrogate": chosen.surrogate, "sets": sets}
    told |= {"sets_found_done": before, "folder": str(out)}
    if as_json:
        say_json(told)
        return
    label(chosen)
    _finish(told)


def _finish(told: dict[str, Any]) -> None:
    if told["sets_found_done"]:
        say(f"found done: {told['sets_found_done']} sets")
    say(f"sets: {told['sets']} in {Path(told['folder']) / 'sets'}")


class _Rate(ProgressColumn):
    """Sets per second of late."""

    def render(self, task: Task) -> Text:
        speed = task.speed
        return Text("" if speed is None else f"{speed:,.0f} sets/s")


@contextmanager
def _bar(sets: int, done: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr with rate and time left; gives the function that moves it by some sets."""
    left = TextColumn("left")
    columns = (BarColumn(), MofNCompleteColumn(), _Rate(), left, TimeRemainingColumn())
    screen = console(stderr=True)
    with Progress(
        *columns,
        console=screen,
        transient=True,
        speed_estimate_period=60,
        disable=not screen.is_interactive,
    ) as bar:
        task = bar.add_task("sets", total=sets, completed=done)
        yield lambda more: bar.advance(task, more)
