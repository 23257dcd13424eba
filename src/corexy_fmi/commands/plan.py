"""``corexy plan``: before any recording, what could be named from which motion."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.table import Table

from corexy_fmi.commands.places import folder_place
from corexy_fmi.commands.screen import (
    JsonOption,
    MachineOption,
    cells,
    console,
    label,
    progress,
    say,
    say_json,
)
from corexy_fmi.errors import InputError
from corexy_fmi.files import write_folder
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.motion import check_kind
from corexy_fmi.programs import named_command, programs, stage_limits
from corexy_fmi.recording import write_recording

if TYPE_CHECKING:
    from corexy_fmi.engine.naming.plan_size import Nameable


def plan(
    machine: MachineOption,
    noise: Annotated[
        float, typer.Option(metavar="SIGMA", min=0.0, help="Noise of measured x and y [m].")
    ],
    speed: Annotated[float, typer.Option(help="Path speed that the machine bears [m/s].")] = 0.1,
    acceleration: Annotated[float, typer.Option(help="Acceleration that it bears [m/s^2].")] = 2.0,
    rate: Annotated[float, typer.Option(help="Samples of x and y a second [Hz].")] = 1000.0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the programs.", parser=folder_place),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Tell for every effect the smallest size that could be named, and from which program.

    Programs last at most 10 s and keep within the stage, the speed and the acceleration. The sizes
    are estimates, named as often as not: the machine file is taken as true within its uncertainty,
    the noise as white.

    Examples:

    corexy plan --machine printer.toml --noise 2e-5

    corexy plan --machine light_bench --noise 1e-5 --speed 0.2 --out programs
    """
    from corexy_fmi.engine.planning.plan import smallest
    from corexy_fmi.kernel.layout import bundled_layout

    chosen = _checked(check_kind(load_machine(machine)), noise, rate)
    limits = stage_limits(chosen, speed, acceleration)
    orders = {n: named_command(f"{n}.csv", m, chosen, rate) for n, m in programs(limits).items()}
    with progress() as move, ThreadPoolExecutor() as pool:
        doing = iter(("running programs", "fitting rivals"))

        def mapper(function, jobs):  # type: ignore[no-untyped-def]
            what = next(doing)
            for told, result in enumerate(pool.map(function, jobs), 1):
                move(what, told / len(jobs))
                yield result

        found = smallest(bundled_layout(), chosen, orders, noise, mapper)
    if out is not None:
        with write_folder(out) as folder:
            for name, order in orders.items():
                write_recording(order, folder / f"{name.replace(' ', '_')}.csv")
    if as_json:
        say_json({"machine": chosen.name, "surrogate": chosen.surrogate, "noise_std": noise,
                  "nameable": [asdict(row) for row in found]})  # fmt: skip
        return
    label(chosen)
    table = Table("effect", "location", "smallest size", "program", "nearest rival")
    for row in found:
        table.add_row(*cells(row.name, row.location, _size(row), row.program, row.rival))
    console().print(table)
    if out is not None:
        say(f"{out}: {len(orders)} programs")


def _size(row: Nameable) -> str:
    """A size for a person to read; beside a neutral value other than 0, the distance from it."""
    if row.size is None:
        return "none: its rival does the same" if row.rival != "none" else "none: it does not show"
    if row.neutral and np.isfinite(row.neutral):
        return f"{row.parameter} {row.neutral:g} {row.size - row.neutral:+.3g} {row.unit}"
    return f"{row.parameter} {row.size:.3g} {row.unit}"


def _checked(machine: Machine, noise: float, rate: float) -> Machine:
    """The machine, if it can be planned for.

    Raises InputError for a dc machine without a loop, and for noise and rates that mean nothing.
    """
    for name, value in (("noise", noise), ("rate", rate)):
        if not 0 < value < math.inf:
            raise InputError(f"--{name}: found {value!r}, expected a positive number")
    if machine.drive == "dc" and machine.controller is None:
        raise InputError(
            f"machine {machine.name}: drive dc without [controller], expected kp and kd: "
            "programs command angles"
        )
    return machine
