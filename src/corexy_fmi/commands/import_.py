"""``corexy import``: recordings out of other tools' files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.commands.screen import ASSUMED, MachineOption, label, point, say
from corexy_fmi.errors import InputError
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import check_stage
from corexy_fmi.recording import check_drive, write_recording
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.recording.klipper import Move, import_klipper

app = typer.Typer(no_args_is_help=True)


@app.callback()
def formats() -> None:
    """Make a recording out of another tool's file.

    Examples:

    corexy import klipper --help
    """


@app.command("klipper")
def klipper(
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help="Accelerometer file.")],
    move: Annotated[
        str, typer.Option(metavar="X0,Y0:X1,Y1", help="Start and end of the move [m].")
    ],
    speed: Annotated[float, typer.Option(help="Its speed [m/s].")],
    accel: Annotated[float, typer.Option(help="Its acceleration [m/s^2].")],
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="Where the recording goes.")],
    centre: Annotated[
        str, typer.Option("--centre", "--center", metavar="X,Y", help="The stage's centre [m].")
    ] = "0,0",
    axes: Annotated[
        str, typer.Option(metavar="A,B", help="Sensor axes that are the stage's x and y.")
    ] = "x,y",
    start_offset: Annotated[
        float | None,
        typer.Option(help="Start of the move after the first sample [s]; without: clock free."),
    ] = None,
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a Klipper accelerometer file and a described move into a recording.

    The move is a trapezoid from rest to rest; the commanded angles follow from it by eq. (1) with
    the machine's pulley radius. Gravity is removed as the mean at rest.

    Examples:

    corexy import klipper x.csv --move 0.100,0.125:0.150,0.125 --centre 0.125,0.125 --speed 0.1
    --accel 6 --start-offset -0.0008 --axes=-z,+y --machine gt2_printer --out x_recording.csv
    """
    chosen = load_machine(machine)
    origin, start, end = point(centre, "centre"), *_ends(move)
    described = Move(_from(start, origin), _from(end, origin), speed, accel, start_offset)
    recording = import_klipper(file, described, axes, chosen.parameters["pulley_radius"])
    check_stage(recording, chosen)
    write_recording(recording, out)
    label(chosen)
    say(f"recording: {out}")


MapOption = Annotated[
    list[str],
    typer.Option("--map", metavar="OURS=THEIRS[UNIT]", help="A channel and its column; repeat."),
]


@app.command("mat")
def mat(
    file: Annotated[Path, typer.Argument(metavar="FILE.mat", help="MATLAB file, to version 7.")],
    columns: MapOption,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="Where the recording goes.")],
    about: Annotated[
        list[str] | None,
        typer.Option("--about", metavar="KEY:VALUE", help="A line of metadata; repeat."),
    ] = None,
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a MATLAB file into a recording, by a map of its variables with their units.

    Units: s ms us, m mm um, m/s mm/s, m/s^2 mm/s^2 g, rad deg rev steps, V mV, A mA; without one,
    that of the channel. A length given for an angle is travel over the machine's pulley radius.

    Examples:

    corexy import mat run.mat --map time=t --map "phi1=ref[mm]" --map "x=pos[mm]" --about
    "controller: pd kp=20 kd=0.1" --about "motors: 1" --machine axis.toml --out run.csv
    """
    _import_columns(file, columns, out, about, machine)


@app.command("csv")
def csv(
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help="A table with a header.")],
    columns: MapOption,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="Where the recording goes.")],
    about: Annotated[
        list[str] | None,
        typer.Option("--about", metavar="KEY:VALUE", help="A line of metadata; repeat."),
    ] = None,
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a table of numbers into a recording, by a map of its columns with their units.

    Units as of ``corexy import mat``.

    Examples:

    corexy import csv log.csv --map "time=t_ms[ms]" --map "phi1=m1[deg]" --map "phi2=m2[deg]"
    --map "ax=acc_x[g]" --about "clock: free" --out run.csv
    """
    _import_columns(file, columns, out, about, machine)


def _import_columns(
    file: Path, columns: list[str], out: Path, about: list[str] | None, machine: str
) -> None:
    """Write the recording, once it reads back as one."""
    chosen = load_machine(machine)
    told = dict(_about(line) for line in about or [])
    recording = import_columns(file, columns, told, chosen.parameters["pulley_radius"])
    check_drive(recording, chosen)
    write_recording(recording, out)
    label(chosen)
    say(f"recording: {out}")


def _about(line: str) -> tuple[str, str]:
    """Key and value of one line of metadata."""
    key, colon, value = line.partition(":")
    if not colon or not key.strip():
        raise InputError(f"about: found {line!r}, expected KEY: VALUE")
    return key.strip(), value.strip()


def _ends(text: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Both ends of a move [m]."""
    start, colon, end = text.partition(":")
    if not colon:
        raise InputError(f"move: found {text!r}, expected X0,Y0:X1,Y1 in m")
    ends = point(start, "move"), point(end, "move")
    if ends[0] == ends[1]:
        raise InputError(f"move: found {text!r}, expected two different ends")
    return ends


def _from(point: tuple[float, float], origin: tuple[float, float]) -> tuple[float, float]:
    return point[0] - origin[0], point[1] - origin[1]
