"""``corexy import csv`` and ``mat``: any table by a map of its columns; two logs merged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.commands.places import OutOption, keep_apart
from corexy_fmi.commands.screen import ASSUMED, MachineOption, label, say
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.recording import INPUTS, Recording, check_drive, write_checked
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.recording.merge import merge
from corexy_fmi.topology import STAGES

MapOption = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="OURS=THEIRS[UNIT]", help="A channel and its column; repeat."),
]
AboutOption = Annotated[
    list[str] | None,
    typer.Option("--about", metavar="KEY:VALUE", help="A line of metadata; repeat."),
]


def mat(
    file: Annotated[Path, typer.Argument(metavar="FILE.mat", help="MATLAB file, to version 7.")],
    columns: MapOption = None,
    *,
    out: OutOption,
    about: AboutOption = None,
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a MATLAB file into a recording, by a map of its variables with their units.

    Units: s ms us, m mm um, m/s mm/s, m/s^2 mm/s^2 g, rad deg rev steps (200 a turn; steps400/16),
    V mV, A mA; without one, that of the channel. A length given for an angle is travel over the
    machine's pulley radius.

    Examples:

    corexy import mat run.mat --map time=t --map "phi1=ref[mm]" --map "x=pos[mm]" --about
    "controller: pd kp=20 kd=0.1" --about "motors: 1" --machine axis.toml --out run.csv
    """
    chosen = load_machine(machine)
    keep_apart([out], [file], machine)
    radius = chosen.parameters["pulley_radius"]
    _keep(import_columns(file, columns or [], _told(about), radius), chosen, out)


def csv(
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE.csv]", help="A table with a header.")
    ] = None,
    columns: MapOption = None,
    *,
    out: OutOption,
    about: AboutOption = None,
    commands: Annotated[
        Path | None, typer.Option(metavar="A.csv", help="Log of the commands, instead of FILE.")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option(metavar="B.csv", help="Log of the measurements.")
    ] = None,
    align: Annotated[
        bool, typer.Option("--align", help="The logs have two clocks: bring them together.")
    ] = False,
    machine: MachineOption = ASSUMED,
) -> None:
    """Turn a table of numbers into a recording, by a map of its columns with their units.

    Units as of `corexy import mat`. Without a map, columns that already have our names are taken,
    as of fmpy's results. With `--commands` and `--measured`, inputs are of the first log and
    measured channels of the second; `time` given twice is that of the first, then of the second.
    `--align` finds offset and drift of the second clock by cross-correlation, writes both with
    their uncertainty into the recording and leaves the clock free in a diagnosis.

    Examples:

    corexy import csv log.csv --map "time=t_ms[ms]" --map "phi1=m1[deg]" --map "phi2=m2[deg]"
    --map "ax=acc_x[g]" --about "clock: free" --out run.csv

    corexy import csv --commands steps.csv --measured tracker.csv --align --map time=t --map
    "phi1=m1[steps/16]" --map "phi2=m2[steps/16]" --map time=stamp --map "x=px[mm]" --out run.csv
    """
    chosen = load_machine(machine)
    keep_apart([out], [file, commands, measured], machine)
    told, entries = _told(about), columns or []
    if file is not None and commands is None and measured is None and not align:
        radius = chosen.parameters["pulley_radius"]
        _keep(import_columns(file, entries, told, radius), chosen, out)
        return
    if file is not None or commands is None or measured is None:
        raise InputError("import csv: expected FILE.csv, or --commands A.csv with --measured B.csv")
    recording = _merged(commands, measured, entries, told, chosen, align)
    if "aligned" in recording.metadata:
        say(f"clock of {measured.name} against {commands.name}: {recording.metadata['aligned']}")
    _keep(recording, chosen, out)


def _merged(
    commands: Path,
    measured: Path,
    entries: Sequence[str],
    about: dict[str, str],
    machine: Machine,
    align: bool,
) -> Recording:
    """Both logs as one recording."""
    radius = machine.parameters["pulley_radius"]
    first, second = _shared_out(entries)
    x, y = STAGES[machine.stage].rest
    rest = (radius * x[0], radius * x[1]), (radius * y[0], radius * y[1])
    return merge(
        import_columns(commands, first, {}, radius),
        import_columns(measured, second, {}, radius),
        rest,
        about,
        align=align,
    )


def _shared_out(entries: Sequence[str]) -> tuple[list[str], list[str]]:
    """Entries of the commands' log and of the measurements'."""
    ours = [entry.partition("=")[0].strip() for entry in entries]
    times = [e for e, name in zip(entries, ours, strict=True) if name == "time"]
    given = [e for e, name in zip(entries, ours, strict=True) if name in INPUTS]
    seen = [e for e, name in zip(entries, ours, strict=True) if name not in (*INPUTS, "time")]
    return [*times[:1], *given] if given else [], [*times[-1:], *seen] if seen else []


def _keep(recording: Recording, machine: Machine, out: Path) -> None:
    """Write a recording that the machine's drive can replay."""
    check_drive(recording, machine)
    write_checked(recording, out)
    label(machine)
    say(f"recording: {out}")


def _told(lines: list[str] | None) -> dict[str, str]:
    """Metadata by key."""
    told: dict[str, str] = {}
    for key, value in map(_about, lines or []):
        if key in told:
            raise InputError(f"about: {key!r} twice, expected once")
        told[key] = value
    return told


def _about(line: str) -> tuple[str, str]:
    """Key and value of one line of metadata."""
    key, colon, value = line.partition(":")
    if not colon or not key.strip():
        raise InputError(f"about: found {line!r}, expected KEY: VALUE")
    return key.strip(), value.strip()
