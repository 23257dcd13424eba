"""``corexy pulses``: a path as the step pulses of both motors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from corexy_fmi.commands.places import file_place, keep_apart
from corexy_fmi.commands.screen import ASSUMED, MachineOption, label, point, say
from corexy_fmi.errors import InputError
from corexy_fmi.gcode import read_gcode
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.motion import check_stage, follow
from corexy_fmi.nearest import nearest
from corexy_fmi.pulses import Driver, staircase
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.recording.record import ANGLES

GCODE = (".gcode", ".gco", ".g", ".nc", ".ngc", ".tap")


def pulses(
    path: Annotated[
        Path, typer.Argument(metavar="PATH", help="G-code, or a CSV of phi1, phi2 or of x, y.")
    ],
    out: Annotated[
        Path, typer.Option(metavar="FILE.csv", help="Where the pulses go.", parser=file_place)
    ],
    microsteps: Annotated[int, typer.Option(help="In a full step: 1, 2, 8, 16 ..")] = 16,
    steps: Annotated[int, typer.Option(help="Full steps in a turn of the motor.")] = 200,
    speed: Annotated[
        float | None, typer.Option(help="G-code: speed until the first F [m/s].")
    ] = None,
    accel: Annotated[
        float | None,
        typer.Option(help="G-code: each move a trapezoid [m/s^2]; without: constant speed."),
    ] = None,
    centre: Annotated[
        str,
        typer.Option("--centre", "--center", metavar="X,Y", help="The stage's centre in PATH [m]."),
    ] = "0,0",
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a path into pulse-accurate motor angles: each pulse is a jump at its exact time.

    The file is a recording that `corexy simulate` replays on the model or the FMU. A G-code program
    begins at the first place that it names in X and Y.

    Examples:

    corexy pulses part.gcode --microsteps 1 --centre 0.1,0.1 --machine gt2_printer --out full.csv

    corexy simulate full.csv --plant fmu --machine gt2_printer --out response.csv
    """
    chosen, driver = load_machine(machine), Driver(microsteps, steps)
    keep_apart([out], [path], machine)
    origin = point(centre, "centre")
    order = _order(path, chosen, origin, speed, accel)
    made = pulsed(order, chosen, driver)
    write_recording(replace(made, name=out.name), out)
    label(chosen)
    say(f"pulses: {made.metadata['pulses']}")
    say(f"recording: {out}")


def pulsed(order: Recording, machine: Machine, driver: Driver) -> Recording:
    """A stepper machine's command as pulses.

    Raises InputError for another drive, and where it leaves the stage.
    """
    if machine.drive != "stepper":
        raise InputError(
            f"machine {machine.name!r}: drive {machine.drive!r} takes no pulses, expected a stepper"
        )
    check_stage(order, machine)
    return staircase(order, driver)


def _order(
    path: Path,
    machine: Machine,
    centre: tuple[float, float],
    speed: float | None,
    accel: float | None,
) -> Recording:
    """The ideal command of a file."""
    radius, ending = machine.parameters["pulley_radius"], path.suffix.lower()
    if ending in GCODE:
        return follow(read_gcode(path, speed=speed, acceleration=accel), radius, centre)
    if ending != ".csv":
        known = [".csv", *GCODE]
        raise InputError(
            f"{path}: ending {ending!r}, expected one of {' '.join(known)}{nearest(ending, known)}"
        )
    if speed is not None or accel is not None:
        raise InputError(f"{path}: --speed and --accel are for G-code, expected a path without")
    given = read_recording(path, needs_inputs=False)
    if all(name in given for name in ANGLES):
        return replace(given, channels={name: given[name] for name in ANGLES})
    if not all(name in given for name in "xy"):
        raise InputError(f"{path}: no columns phi1, phi2 and no x, y, expected one of the pairs")
    return follow(_sampled(given), radius, centre)


def _sampled(given: Recording) -> Recording:
    """The rows in which x and y were taken."""
    rows = ~(np.isnan(given["x"]) | np.isnan(given["y"]))
    if rows.sum() < 2:
        raise InputError(f"{given.name}: {rows.sum()} rows with x and y, expected at least 2")
    return Recording(given.name, given.time[rows], {n: given[n][rows] for n in "xy"})
