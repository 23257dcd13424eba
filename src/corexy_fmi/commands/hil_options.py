"""Options that several `corexy hil` commands share."""

from __future__ import annotations

from typing import Annotated

import typer

from corexy_fmi.commands.hil_run import Dialect

PortOption = Annotated[
    str, typer.Option(metavar="PORT", help="/dev/ttyUSB0, COM3 or socket://host:port.")
]
ArmOption = Annotated[bool, typer.Option("--arm", help="Move motors; without it nothing moves.")]
CentredOption = Annotated[
    bool, typer.Option("--centred", "--centered", help="The carriage stands at the centre now.")
]
TrackerOption = Annotated[
    str | None, typer.Option(metavar="PORT", help="Lines 't x y' [s, m]: a port or udp://:9000.")
]
CountsOption = Annotated[
    int | None,
    typer.Option(help="Counts of a motor revolution; else 3200 microsteps, or 4000 of an encoder."),
]
SupplyOption = Annotated[float, typer.Option(help="Supply of dc motors at full duty [V].")]
SpeedOption = Annotated[float, typer.Option(help="Fastest belt [m/s].")]
AccelOption = Annotated[float, typer.Option(help="Belt acceleration beyond jumps [m/s^2].")]
JumpOption = Annotated[float, typer.Option(help="Largest jump of a belt's speed [m/s].")]
SilenceOption = Annotated[
    float, typer.Option("--watchdog", help="The board stops when the host is silent so long [s].")
]
BesideOption = Annotated[bool, typer.Option("--beside", help="Drive the FMU beside the board.")]
DialectOption = Annotated[
    Dialect, typer.Option(help="This project's firmware, or GRBL 1.1, grblHAL, FluidNC.")
]
HomeOption = Annotated[
    bool, typer.Option("--home", help="Find the place first: each axis to its limit switch.")
]
AtXOption = Annotated[
    float | None,
    typer.Option("--at-x", help="Where the x switch opens [m]; else the stage's lower end."),
]
AtYOption = Annotated[
    float | None,
    typer.Option("--at-y", help="Where the y switch opens [m]; else the stage's lower end."),
]
HomeSpeedOption = Annotated[
    float, typer.Option("--home-speed", help="Carriage on its way to the switches [m/s].")
]
