"""``corexy simulate``: replay a recording's inputs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.commands.places import file_place, keep_apart
from corexy_fmi.commands.plants import Plant, run
from corexy_fmi.commands.screen import EffectsOption, assumed_machine, label, provenance, say
from corexy_fmi.effects import own_effects
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import INPUTS, check_drive, read_recording, write_recording

CARRIED = ("controller", "motors")  # metadata without which it could not be replayed
RESPONSE = ("x", "y", "vx", "vy", "ax", "ay", "phi1_meas", "phi2_meas")


def simulate(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING.csv", help="Inputs to replay.")],
    out: Annotated[
        Path, typer.Option(metavar="FILE.csv", help="Where the response goes.", parser=file_place)
    ],
    machine: Annotated[
        str | None, typer.Option(metavar="FILE", help="Machine file or name; else yin2018.")
    ] = None,
    plant: Annotated[Plant, typer.Option(help="The model, or the FMU.")] = Plant.model,
    effects: EffectsOption = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="No metadata lines: fmpy reads the file as an input.")
    ] = False,
) -> None:
    """Replay the inputs of a recording on a machine's model; one row for each of its rows.

    Writes time, the inputs, x, y, vx, vy, ax, ay, phi1_meas and phi2_meas.

    Examples:

    corexy simulate run.csv --machine gt2_printer --out response.csv
    """
    given = read_recording(recording)
    own = own_effects(effects)
    chosen = load_machine(assumed_machine([given]) if machine is None else machine, own)
    check_drive(given, chosen)
    keep_apart([out], [recording, effects], machine)
    response = run(plant, chosen, given, own)
    loop = {key: text for key, text in given.metadata.items() if key in CARRIED}
    channels = {name: response[name] for name in _columns(response.channels)}
    made = replace(
        response, name=out.name, channels=channels, metadata={**loop, **provenance(chosen, plant)}
    )
    write_recording(made, out, plain=plain)
    label(chosen)
    say(f"response: {out}")


def _columns(names: Iterable[str]) -> list[str]:
    """Inputs first, then the response, in the order of the format."""
    present = set(names)
    return [name for name in (*INPUTS, *RESPONSE) if name in present]
