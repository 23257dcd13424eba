"""``corexy rectangle``: one rectangle run and its corner errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from corexy_fmi.commands.places import file_place, keep_apart
from corexy_fmi.commands.plants import Plant, run
from corexy_fmi.commands.pulses import pulsed
from corexy_fmi.commands.screen import (
    ASSUMED,
    EffectsOption,
    JsonOption,
    MachineOption,
    console,
    label,
    provenance,
    say,
    say_json,
)
from corexy_fmi.corners import Corner, corner_table
from corexy_fmi.effects import own_effects
from corexy_fmi.errors import InputError
from corexy_fmi.figure import check_format, draw_rectangle
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.motion import check_kind, check_stage, command
from corexy_fmi.pulses import Driver
from corexy_fmi.recording import Recording, write_recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.topologies import BY_EQUATION_1


def rectangle(
    width: Annotated[float, typer.Option(help="Size in x [m].")],
    height: Annotated[float, typer.Option(help="Size in y [m].")],
    speed: Annotated[float, typer.Option(help="Speed along the path [m/s].")],
    out: Annotated[
        Path, typer.Option(metavar="FILE.csv", help="Where the recording goes.", parser=file_place)
    ],
    loops: Annotated[int, typer.Option(help="How often around.")] = 1,
    accel: Annotated[
        float | None, typer.Option(help="Trapezoid on every side [m/s^2]; without: constant speed.")
    ] = None,
    microsteps: Annotated[
        int | None, typer.Option(help="Step pulses, so many in a full step; without: smooth.")
    ] = None,
    machine: MachineOption = ASSUMED,
    plant: Annotated[Plant, typer.Option(help="The FMU through fmpy, or the model.")] = Plant.fmu,
    effects: EffectsOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Draw ideal and simulated path.", parser=file_place),
    ] = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="No metadata lines: fmpy reads the file as an input.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Drive one rectangle and print the contour error, eq. (17), and overshoot at every corner.

    Centred on the origin, from bottom left, counter-clockwise, 0.5 s of rest at the end; rows at
    1 kHz and at every corner. With --microsteps the motors get step pulses, two rows each. A dc
    machine is driven by the loop of its [controller].

    Examples:

    corexy rectangle --width 0.06 --height 0.04 --speed 0.039 --out run.csv

    corexy rectangle --width 0.06 --height 0.04 --speed 0.1 --accel 2 --loops 3 --machine
    light_bench --plant model --plot run.png --out run.csv
    """
    own = own_effects(effects)
    chosen = load_machine(machine, own)
    keep_apart([out, plot], [effects], machine)
    shape = Rectangle(width, height, speed, loops, accel)
    order = rectangle_command(shape, chosen, out.name)
    if microsteps is not None:
        order = pulsed(order, chosen, Driver(microsteps))
    if plot is not None:
        check_format(plot)
    response = run(plant, chosen, order, own)
    corners = corner_table(response, shape)
    metadata = {**order.metadata, **provenance(chosen, plant), **_lines(shape, corners)}
    recording = replace(response, name=out.name, metadata=metadata)
    write_recording(recording, out, plain=plain)
    if plot is not None:
        draw_rectangle(recording, shape, corners, chosen, plot)
    if as_json:
        say_json(_document(chosen, plant, shape, corners, out))
        return
    label(chosen)
    show_corners(corners)
    say(f"recording: {out}")
    if plot is not None:
        say(f"plot: {plot}")


def rectangle_command(shape: Rectangle, machine: Machine, name: str) -> Recording:
    """The motor angles of a run, with the loop of a dc machine in the metadata.

    Raises InputError where the run leaves the stage or a dc machine has no controller.
    """
    check_kind(machine, *BY_EQUATION_1)
    order = command(shape.motion, machine.parameters["pulley_radius"], name=name)
    check_stage(order, machine)
    if machine.drive != "dc":
        return order
    if machine.controller is None:
        raise InputError(f"machine {machine.name!r}: no [controller], expected its kp and kd")
    return replace(order, metadata={"controller": machine.controller.line})


def show_corners(corners: Sequence[Corner]) -> None:
    """The corners as a table, in mm."""
    table = Table("corner", "turn", "time (s)", "contour error (mm)", "overshoot (mm)")
    for corner in corners:
        error, over = 1e3 * corner.contour_error, 1e3 * corner.overshoot
        shown = "not crossed" if math.isnan(error) else f"{error:.4f}"
        table.add_row(str(corner.number), corner.turn, f"{corner.time:.4f}", shown, f"{over:.4f}")
    console().print(table)


def _lines(shape: Rectangle, corners: Sequence[Corner]) -> dict[str, str]:
    """Metadata: the run, and a line for each corner [m]."""
    about = {"rectangle": " ".join(f"{k}={v!r}" for k, v in asdict(shape).items() if v is not None)}
    for corner in corners:
        numbers = f"contour_error={corner.contour_error!r} overshoot={corner.overshoot!r}"
        about[f"corner{corner.number}"] = f"{corner.turn} time={corner.time!r} {numbers}"
    return about


def _document(
    machine: Machine, plant: Plant, shape: Rectangle, corners: Sequence[Corner], out: Path
) -> dict[str, Any]:
    """What --json prints; lengths in m."""
    rows = [asdict(corner) for corner in corners]
    for row in rows:
        row["contour_error"] = None if math.isnan(row["contour_error"]) else row["contour_error"]
    return {
        "machine": machine.name,
        "surrogate": machine.surrogate,
        "plant": plant.value,
        "rectangle": asdict(shape),
        "corners": rows,
        "recording": str(out),
    }
