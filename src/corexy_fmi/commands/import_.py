"""``corexy import``: recordings out of other tools' files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.commands import import_table
from corexy_fmi.commands.places import OutOption, keep_apart
from corexy_fmi.commands.screen import ASSUMED, MachineOption, label, point, say
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.motion import check_stage
from corexy_fmi.recording import Recording, write_checked
from corexy_fmi.recording.klipper import Move, import_klipper
from corexy_fmi.recording.motan import import_motan
from corexy_fmi.recording.resonance import import_resonance
from corexy_fmi.resonance import NEW, OLD, changed

app = typer.Typer(no_args_is_help=True)
app.command("csv")(import_table.csv)
app.command("mat")(import_table.mat)
CentreOption = Annotated[
    str, typer.Option("--centre", "--center", metavar="X,Y", help="The stage's centre [m].")
]
AxesOption = Annotated[
    str, typer.Option(metavar="A,B", help="Sensor axes that are the stage's x and y.")
]
DIRECTIONS = {"x": (1.0, 0.0), "y": (0.0, 1.0)}


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
    out: OutOption,
    centre: CentreOption = "0,0",
    axes: AxesOption = "x,y",
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
    keep_apart([out], [file], machine)
    origin, start, end = point(centre, "centre"), *_ends(move)
    described = Move(_from(start, origin), _from(end, origin), speed, accel, start_offset)
    recording = import_klipper(file, described, axes, chosen.parameters["pulley_radius"])
    _keep(recording, chosen, out)


@app.command("resonance")
def resonance(
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help="Raw samples of the test.")],
    axis: Annotated[str, typer.Option(metavar="AXIS", help="x, y, or a direction such as 1,-1.")],
    at: Annotated[str, typer.Option(metavar="X,Y", help="Where the test was made [m].")],
    out: OutOption,
    centre: CentreOption = "0,0",
    axes: AxesOption = "x,y",
    old: Annotated[
        bool, typer.Option("--old", help="Klipper before 2024-12-05: swings about the point.")
    ] = False,
    min_freq: Annotated[float | None, typer.Option(help="First frequency [Hz]; 5.")] = None,
    max_freq: Annotated[
        float | None, typer.Option(help="Last frequency [Hz]; 135, with --old 133.33.")
    ] = None,
    accel_per_hz: Annotated[
        float | None, typer.Option(help="[m/s^2 per Hz]; 0.060, with --old 0.075.")
    ] = None,
    hz_per_sec: Annotated[float | None, typer.Option(help="[Hz/s]; 1.")] = None,
    sweeping_accel: Annotated[float | None, typer.Option(help="[m/s^2]; 0.4; not --old.")] = None,
    sweeping_period: Annotated[float | None, typer.Option(help="[s]; 1.2; 0: none.")] = None,
    max_accel: Annotated[
        float | None, typer.Option(help="The machine's own, for the last stop [m/s^2]; 3.")
    ] = None,
    start_offset: Annotated[
        float | None,
        typer.Option(help="First pulse after the first sample [s]; without: found, clock free."),
    ] = None,
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn the raw samples of Klipper's TEST_RESONANCES into a recording.

    The commanded pulses are rebuilt from the test's settings (`[resonance_tester]`, there in mm).
    The file must be of `OUTPUT=raw_data`: a spectrum holds no course of time.

    Examples:

    corexy import resonance raw_data_x.csv --axis x --at 0.125,0.125 --centre 0.125,0.125
    --axes=-z,+y --machine machine.toml --out x_sweep.csv
    """
    chosen = load_machine(machine)
    keep_apart([out], [file], machine)
    given = {"first": min_freq, "last": max_freq, "per_hertz": accel_per_hz, "rate": hz_per_sec,
             "sweep": sweeping_accel, "period": sweeping_period, "stop": max_accel}  # fmt: skip
    test = changed(OLD if old else NEW, given)
    start = _from(point(at, "at"), point(centre, "centre"))
    radius = chosen.parameters["pulley_radius"]
    recording = import_resonance(file, test, _direction(axis), start, axes, radius, start_offset)
    say(f"first pulse {recording.metadata['first_pulse']}")
    _keep(recording, chosen, out)


@app.command("motan")
def motan(
    file: Annotated[Path, typer.Argument(metavar="NAME.json.gz", help="A capture.")],
    out: OutOption,
    centre: CentreOption = "0,0",
    axes: AxesOption = "x,y",
    sensor: Annotated[str, typer.Option(help="Which accelerometer, where there are several.")] = "",
    span: Annotated[
        str, typer.Option(metavar="T0:T1", help="Only this part, after the first sample [s].")
    ] = "",
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a capture of Klipper's motion analysis (data_logger.py) into a recording.

    The toolhead's moves and the accelerometer stand in it on one clock. Input shaping is no part of
    the moves: turn it off for such a capture.

    Examples:

    corexy import motan mylog.json.gz --centre 0.125,0.125 --axes x,y --machine machine.toml
    --out run.csv
    """
    chosen = load_machine(machine)
    keep_apart([out], [file], machine)
    recording = import_motan(
        file, axes, point(centre, "centre"), chosen.parameters["pulley_radius"], sensor, _span(span)
    )
    if "shaper" in recording.metadata:
        say("input shaping is configured in this capture; the commands here are those before it")
    _keep(recording, chosen, out)


def _keep(recording: Recording, machine: Machine, out: Path) -> None:
    """Write a recording that stays on the stage."""
    check_stage(recording, machine)
    write_checked(recording, out)
    label(machine)
    say(f"recording: {out}")


def _direction(text: str) -> tuple[float, float]:
    """x, y, or two numbers."""
    found = DIRECTIONS.get(text.strip().lower())
    if found is None:
        try:
            found = point(text, "axis")
        except InputError:
            found = (0.0, 0.0)
    if found == (0.0, 0.0):
        raise InputError(f"axis: found {text!r}, expected x, y, or a direction such as 1,-1")
    return found


def _span(text: str) -> tuple[float, float] | None:
    """Begin and end [s]; None for nothing."""
    if not text:
        return None
    try:
        begin, end = (float(part) for part in text.split(":"))
    except ValueError:
        begin = end = 0.0
    if not 0 <= begin < end:
        raise InputError(f"span: found {text!r}, expected T0:T1 in s such as 2:9.5")
    return begin, end


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
