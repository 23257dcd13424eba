"""``corexy build``: write the FMU of a machine."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.commands.places import folder_place
from corexy_fmi.commands.screen import ASSUMED, EffectsOption, label, say
from corexy_fmi.effects import catalogue, own_effects
from corexy_fmi.machine import load_machine


class Flavour(StrEnum):
    """Self-contained binaries, or a slave that runs in a host's Python."""

    native = "native"
    python = "python"


def build(
    flavour: Annotated[Flavour, typer.Option(help="Native binary, or pythonfmu.")] = Flavour.native,
    machine: Annotated[
        str | None, typer.Option(metavar="FILE", help="Machine that the FMU holds; else yin2018.")
    ] = None,
    effects: EffectsOption = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for it.", parser=folder_place)
    ] = Path(),
    all_platforms: Annotated[
        bool,
        typer.Option(
            "--all-platforms", help="Linux, Windows and macOS in one file; needs ziglang."
        ),
    ] = False,
) -> None:
    """Build the FMU (FMI 2.0, co-simulation).

    Examples:

    corexy build --out build

    corexy build --machine DIR/machine.toml --flavour python --out build

    corexy build --all-platforms --out build
    """
    from corexy_fmi.fmu.build import build_fmu

    own = own_effects(effects)
    chosen = load_machine(ASSUMED if machine is None else machine, own)
    built = build_fmu(
        out,
        chosen if machine else None,
        flavour.value,
        catalogue() | own,
        all_platforms=all_platforms,
    )
    label(chosen)
    say(f"FMU: {built} ({built.stat().st_size / 1e6:.2f} MB)")
