"""Fig. 3: the rectangle at three speeds, ideal, 4-DoF and full, loop after loop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from corexy_fmi.corners import Corner, corner_table
from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.motion import check_stage, command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import TURNS, Rectangle
from corexy_fmi.reproduce.paper import LATER, MODELS, SPEEDS, label
from corexy_fmi.reproduce.plant import plant
from corexy_fmi.reproduce.result import Cell, Result, Table

WIDTH, HEIGHT, LOOPS = 0.06, 0.04, 20  # [m]; the paper's sizes did not reach us
COLOURS = {"ideal": "#888888", "4-DoF": "#d95f02", "condensed": "#8e44ad", "full": "#1f5fbf"}
MILLI = 1e3  # [mm/m]
THIN = 40  # of the rows of a straight run, one in so many is drawn
HEAD = (
    "model",
    "speed [m/s]",
    "turn",
    "error, first [mm]",
    "error, later mean [mm]",
    "later spread [mm]",
    "overshoot [mm]",
    "reference, later [mm]",
)
Runs = dict[tuple[str, float], Recording]


def fig3(machine: Machine, loops: int, report: Callable[[str, float], None]) -> Result:
    """Run and tabulate; raises InputError for fewer than two loops or a stage too small."""
    if loops < 2:
        raise InputError(f"loops: found {loops!r}, expected at least 2, the first is not typical")
    runs, rows = _runs(machine, loops, report), []
    for (model, speed), run in runs.items():
        corners = corner_table(run, Rectangle(WIDTH, HEIGHT, speed, loops))
        rows += [_row(machine, model, speed, turn, corners) for turn in TURNS]
    title = f"Fig. 3: rectangle of 60 mm x 40 mm, {loops} loops, eq. (17) at its corners"
    return Result(
        name="fig3",
        title=title,
        label=label(machine),
        command=f"corexy reproduce fig3 --machine {machine.name} --loops {loops}",
        tables=(Table("Corners through the FMU", HEAD, tuple(rows)),),
        notes=(
            "first: the first corner of that turn; later: all after it",
            "reference: the project's specification, P1, from the second corner on",
            "the rectangle's size is this project's, the paper's did not reach us",
        ),
        draw=lambda figure: _draw(figure, runs, loops),
    )


def _runs(machine: Machine, loops: int, report: Callable[[str, float], None]) -> Runs:
    """Every model at every speed, through the FMU."""
    found: Runs = {}
    with plant(machine) as stage:
        for speed in SPEEDS:
            motion = Rectangle(WIDTH, HEIGHT, speed, loops).motion
            order = command(motion, stage.radius, name="fig3")
            check_stage(order, machine)
            for model in MODELS:
                report(f"{model} at {speed:g} m/s", len(found) / (len(SPEEDS) * len(MODELS)))
                found[model, speed] = stage.run(order, model)
    return found


def _row(
    machine: Machine, model: str, speed: float, turn: str, corners: tuple[Corner, ...]
) -> tuple[Cell, ...]:
    """One line of the table."""
    mine = [corner for corner in corners if corner.turn == turn]
    later = MILLI * np.array([corner.contour_error for corner in mine[1:]])
    over = MILLI * max(corner.overshoot for corner in mine)
    reference = LATER.get((model, turn)) if machine.name == "yin2018" else None
    known = None if reference is None else reference[SPEEDS.index(speed)]
    first = MILLI * mine[0].contour_error
    return model, speed, turn, first, float(later.mean()), float(np.ptp(later)), over, known


def _draw(figure: Figure, runs: Runs, loops: int) -> None:
    """A row for the whole path, one for each turn near by; a column for each speed."""
    grid = figure.subplots(3, len(SPEEDS))
    for column, speed in enumerate(SPEEDS):
        shape = Rectangle(WIDTH, HEIGHT, speed, loops)
        last = shape.vertex_times[-5], shape.vertex_times[-1]
        grid[0, column].set_title(f"{MILLI * speed:g} mm/s", fontsize=9)
        for model in MODELS:
            run = runs[model, speed]
            inside = (run.time >= last[0]) & (run.time <= last[1])
            path = MILLI * np.column_stack([run["x"][inside], run["y"][inside]])
            _line(grid[0, column], path[::THIN], model)
            for line, vertex in ((1, shape.vertices[-4]), (2, shape.vertices[-3])):
                _near(grid[line, column], path, MILLI * vertex, 22 * speed, model)
    grid[0, 0].legend(fontsize=7, loc="center")
    for axes, name in zip(grid[:, 0], ("all", *TURNS), strict=True):
        axes.set_ylabel(f"{name}: y [mm]")
    for axes in grid[2]:
        axes.set_xlabel("x [mm]")


def _near(axes: Axes, path: np.ndarray, corner: np.ndarray, span: float, model: str) -> None:
    """A corner with so many mm around it."""
    close = np.abs(path - corner).max(axis=1) < 1.3 * span
    rows = path[close]
    _line(axes, rows[:: max(1, len(rows) // 150)], model)
    axes.set_xlim(corner[0] - span, corner[0] + span)
    axes.set_ylim(corner[1] - span, corner[1] + span)


def _line(axes: Axes, path: np.ndarray, model: str) -> None:
    style = "--" if model == "ideal" else "-"
    axes.plot(path[:, 0], path[:, 1], style, color=COLOURS[model], linewidth=1, label=model)
