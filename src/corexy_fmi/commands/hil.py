"""``corexy hil``: the board of `firmware/`, driven, checked and watched."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from corexy_fmi.commands.hil_board import check, home, monitor, release
from corexy_fmi.commands.hil_diagnose import EXPERIMENTS, commission, result_files, shapes
from corexy_fmi.commands.hil_grbl import execute_grbl
from corexy_fmi.commands.hil_home import check_switches
from corexy_fmi.commands.hil_options import (
    AccelOption,
    ArmOption,
    AtXOption,
    AtYOption,
    BesideOption,
    CentredOption,
    CountsOption,
    DialectOption,
    HomeOption,
    JumpOption,
    PortOption,
    SilenceOption,
    SpeedOption,
    SupplyOption,
    TrackerOption,
)
from corexy_fmi.commands.hil_run import Dialect, Setup, execute, open_bench
from corexy_fmi.commands.places import OutOption, folder_place, keep_apart
from corexy_fmi.commands.rectangle import rectangle_command, show_corners
from corexy_fmi.commands.screen import (
    ASSUMED,
    MachineOption,
    label,
    say,
)
from corexy_fmi.commands.verdict import show_verdict
from corexy_fmi.corners import corner_table, passing_times
from corexy_fmi.errors import InputError
from corexy_fmi.hil.homing import Switches
from corexy_fmi.hil.limits import Allowed
from corexy_fmi.hil.live import part_of
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import check_kind, check_stage
from corexy_fmi.recording import Recording, check_drive, read_recording
from corexy_fmi.rectangle import Rectangle

app = typer.Typer(no_args_is_help=True)


@app.callback()
def hil() -> None:
    """Hardware in the loop: stream motions to the board, record, compare with the FMU.

    Proven on an emulated board, not yet run on real motors. Nothing moves without --arm.
    A board with GRBL, grblHAL or FluidNC: --dialect grbl, docs/grbl.md.

    Examples:

    corexy hil check --port /dev/ttyUSB0

    corexy hil check --dialect grbl --port /dev/ttyUSB0

    corexy hil rectangle --width 0.06 --height 0.04 --speed 0.039 --port /dev/ttyUSB0 --out run.csv
    """


@app.command("run")
def run(
    motion: Annotated[Path, typer.Argument(metavar="MOTION.csv", help="Columns time, phi1, phi2.")],
    port: PortOption,
    out: OutOption,
    machine: MachineOption = ASSUMED,
    arm: ArmOption = False,
    centred: CentredOption = False,
    tracker: TrackerOption = None,
    beside: BesideOption = False,
    counts: CountsOption = None,
    supply: SupplyOption = 24.0,
    max_speed: SpeedOption = Allowed.speed,
    max_accel: AccelOption = Allowed.acceleration,
    max_jump: JumpOption = Allowed.jump,
    watchdog: SilenceOption = Allowed.silence,
    dialect: DialectOption = Dialect.binary,
    home: HomeOption = False,
    at_x: AtXOption = None,
    at_y: AtYOption = None,
) -> None:
    """Play a recording's phi1, phi2 on the board and record what comes back.

    The carriage first goes slowly to the start of the motion. Limits come from the machine file.

    Examples:

    corexy hil run run.csv --port /dev/ttyUSB0 --out measured.csv

    corexy hil run run.csv --port /dev/ttyUSB0 --centred --arm --tracker udp://:9000 --out m.csv
    """
    order, chosen = read_recording(motion), check_kind(load_machine(machine))
    check_drive(order, chosen)
    if "phi1" not in order:
        raise InputError(f"{motion}: no columns phi1, phi2, expected commanded angles")
    check_stage(order, chosen)
    keep_apart([out, part_of(out)], [motion], machine)
    label(chosen)
    allowed = Allowed(max_speed, max_accel, max_jump, watchdog)
    switches = Switches(at_x, at_y)
    setup = Setup(
        machine=chosen, counts=counts, allowed=allowed, port=port, out=out, tracker=tracker,
        centred=centred, arm=arm, beside=beside, supply=supply, home=home, switches=switches,
    )  # fmt: skip
    _play(dialect, setup, order)


@app.command("rectangle")
def rectangle(
    width: Annotated[float, typer.Option(help="Size in x [m].")],
    height: Annotated[float, typer.Option(help="Size in y [m].")],
    speed: Annotated[float, typer.Option(help="Speed along the path [m/s].")],
    port: PortOption,
    out: OutOption,
    loops: Annotated[int, typer.Option(help="How often around.")] = 1,
    accel: Annotated[
        float | None, typer.Option(help="Trapezoid on every side [m/s^2]; without: constant speed.")
    ] = None,
    machine: MachineOption = ASSUMED,
    arm: ArmOption = False,
    centred: CentredOption = False,
    tracker: TrackerOption = None,
    beside: BesideOption = False,
    counts: CountsOption = None,
    supply: SupplyOption = 24.0,
    max_speed: SpeedOption = Allowed.speed,
    max_accel: AccelOption = Allowed.acceleration,
    max_jump: JumpOption = Allowed.jump,
    watchdog: SilenceOption = Allowed.silence,
    dialect: DialectOption = Dialect.binary,
    home: HomeOption = False,
    at_x: AtXOption = None,
    at_y: AtYOption = None,
) -> None:
    """Drive the rectangle of `corexy rectangle` on the board.

    Examples:

    corexy hil rectangle --width 0.06 --height 0.04 --speed 0.039 --port COM3 --out run.csv

    corexy hil rectangle --width 0.06 --height 0.04 --speed 0.039 --port /dev/ttyUSB0 --centred
    --arm --tracker udp://:9000 --beside --out run.csv
    """
    chosen = check_kind(load_machine(machine))
    shape = Rectangle(width, height, speed, loops, accel)
    keep_apart([out, part_of(out)], [], machine)
    order = rectangle_command(shape, chosen, out.name)
    label(chosen)
    allowed = Allowed(max_speed, max_accel, max_jump, watchdog)
    switches = Switches(at_x, at_y)
    setup = Setup(
        machine=chosen, counts=counts, allowed=allowed, port=port, out=out, tracker=tracker,
        centred=centred, arm=arm, beside=beside, supply=supply, home=home, switches=switches,
    )  # fmt: skip
    made = _play(dialect, setup, replace(order, metadata={}))
    if made is not None and "x" in made:
        radius = chosen.parameters["pulley_radius"]
        own = dialect is Dialect.grbl  # such a controller keeps a timing of its own
        times = passing_times(made, shape, radius) if own else None
        show_corners(corner_table(made, shape, times))


def _play(dialect: Dialect, setup: Setup, order: Recording) -> Recording | None:
    """A run on the board that speaks this dialect."""
    check_switches(dialect, setup.switches)
    return execute_grbl(setup, order) if dialect is Dialect.grbl else execute(setup, order)


@app.command("diagnose")
def diagnose(
    port: PortOption,
    tracker: Annotated[str, typer.Option(metavar="PORT", help="Lines 't x y': port or udp://.")],
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for results.", parser=folder_place),
    ],
    machine: MachineOption = ASSUMED,
    arm: ArmOption = False,
    centred: CentredOption = False,
    counts: CountsOption = None,
    supply: SupplyOption = 24.0,
    max_speed: SpeedOption = Allowed.speed,
    max_accel: AccelOption = Allowed.acceleration,
    max_jump: JumpOption = Allowed.jump,
    watchdog: SilenceOption = Allowed.silence,
    home: HomeOption = False,
    at_x: AtXOption = None,
    at_y: AtYOption = None,
    experiments: Annotated[
        int, typer.Option(min=0, help="Further motions at most, while the verdict is ambiguous.")
    ] = EXPERIMENTS,
    jobs: Annotated[int, typer.Option(min=1, help="Workers of the diagnosis.")] = 1,
) -> None:
    """Drive two commissioning rectangles, and diagnose what the tracker saw of them.

    The second is held out, to judge. While the verdict is ambiguous, the motion that it proposes is
    driven, too, and all is diagnosed again. Writes the recordings and the files of `corexy
    diagnose`, a machine file among them.

    Examples:

    corexy hil diagnose --port /dev/ttyUSB0 --tracker udp://:9000 --out result

    corexy hil diagnose --port /dev/ttyUSB0 --tracker udp://:9000 --centred --arm --out result
    """
    chosen = check_kind(load_machine(machine))
    keep_apart(result_files(out), [], machine)
    label(chosen)
    allowed = Allowed(max_speed, max_accel, max_jump, watchdog)
    switches = Switches(at_x, at_y)
    setup = Setup(
        machine=chosen, counts=counts, allowed=allowed, port=port, out=out, tracker=tracker,
        centred=centred, arm=arm, supply=supply, home=home, switches=switches,
    )  # fmt: skip
    if not arm:
        for name, shape in shapes(chosen).items():
            execute(setup, replace(rectangle_command(shape, chosen, name), metadata={}))
        return
    board, source = open_bench(setup)
    assert source is not None
    show_verdict(commission(setup, board, source, jobs, experiments))
    for path in result_files(out):
        say(f"{path}")


for command in (check, monitor, release, home):
    app.command(command.__name__)(command)
