"""``corexy simulate``: replay a recording's inputs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from corexy_fmi.commands.places import file_place, keep_apart
from corexy_fmi.commands.plants import Plant, run
from corexy_fmi.commands.screen import EffectsOption, assumed_machine, label, provenance, say
from corexy_fmi.effects import own_effects
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.recording import (
    INPUTS,
    Recording,
    check_drive,
    inputs,
    read_recording,
    write_recording,
)

Array = NDArray[np.float64]
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

    Writes time, the inputs, x, y, vx, vy, ax, ay, phi1_meas and phi2_meas. A dc machine follows
    references by the loop that the recording names, else by its own, which gives V1 and V2.

    Examples:

    corexy simulate run.csv --machine gt2_printer --out response.csv
    """
    given = read_recording(recording)
    own = own_effects(effects)
    chosen = load_machine(assumed_machine([given]) if machine is None else machine, own)
    check_drive(given, chosen)
    keep_apart([out], [recording, effects], machine)
    response = run(plant, chosen, given, own)
    told = {**_carried(given, chosen), **provenance(chosen, plant)}
    channels = {name: response[name] for name in _columns(response.channels)}
    if plain:
        channels |= _whole(channels, given)
    made = replace(response, name=out.name, channels=channels, metadata=told)
    write_recording(made, out, plain=plain)
    label(chosen)
    say(f"response: {out}")


def _carried(given: Recording, machine: Machine) -> dict[str, str]:
    """Metadata without which the response could not be replayed; a machine's loop among them."""
    told = {key: text for key, text in given.metadata.items() if key in CARRIED}
    if machine.drive == "dc" and machine.controller is not None and "phi1" in given:
        told.setdefault("controller", machine.controller.line)
    return told


def _whole(channels: Mapping[str, Array], given: Recording) -> dict[str, Array]:
    """The inputs with what was run where a recording has blanks, which fmpy does not read."""
    return {
        name: np.where(np.isnan(channels[name]), run, channels[name])
        for name, run in inputs(given).items()
    }


def _columns(names: Iterable[str]) -> list[str]:
    """Inputs first, then the response, in the order of the format."""
    present = set(names)
    return [name for name in (*INPUTS, *RESPONSE) if name in present]
