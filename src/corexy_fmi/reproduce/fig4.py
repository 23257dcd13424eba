"""Fig. 4: contour error against speed, both turns, all models, with straight lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from corexy_fmi.machine import Machine
from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce.fig3 import COLOURS, MILLI
from corexy_fmi.reproduce.paper import MODELS, SINGLE, SPEEDS, label
from corexy_fmi.reproduce.plant import plant
from corexy_fmi.reproduce.result import Cell, Result, Table

ALL_SPEEDS = (0.010, 0.020, 0.030, 0.039, 0.050, 0.060, 0.070, 0.079)  # [m/s]
GAP = "full - 4-DoF"
HEAD = ("turn", "speed [m/s]", "model", "error [mm]", "overshoot [mm]", "reference [mm]")
FIT_HEAD = ("turn", "line", "slope [mm per m/s]", "at rest [mm]", "r squared")
SHORT_HEAD = ("turn", "speed [m/s]", "4-DoF", "condensed")
Array = NDArray[np.float64]
Curves = Mapping[tuple[str, str], Array]  # (model, turn) to (speeds, 2): error, overshoot [mm]


def fig4(machine: Machine, report: Callable[[str, float], None]) -> Result:
    """Run and tabulate single corners, the other axis never moved before."""
    curves = _curves(machine, report)
    return Result(
        name="fig4",
        title="Fig. 4: contour error, eq. (17), against speed, single corners",
        label=label(machine),
        command=f"corexy reproduce fig4 --machine {machine.name}",
        tables=(
            Table("Corners through the FMU", HEAD, tuple(_points(machine, curves))),
            Table("Straight lines through them", FIT_HEAD, tuple(_fits(curves))),
            Table("Error over that of the full model, less one", SHORT_HEAD, tuple(_short(curves))),
        ),
        notes=(
            "reference: the project's specification, P1, another solver",
            "condensed is no model of the paper: its 4-DoF model with idlers at static weights",
        ),
        draw=lambda figure: _draw(figure, curves),
    )


def _curves(machine: Machine, report: Callable[[str, float], None]) -> Curves:
    """Every model and turn over all speeds."""
    found: dict[tuple[str, str], Array] = {}
    with plant(machine) as stage:
        for model in MODELS:
            for turn in TURNS:
                report(f"{model} {turn}", len(found) / (len(MODELS) * len(TURNS)))
                values = [stage.corner(turn, speed, model) for speed in ALL_SPEEDS]
                found[model, turn] = MILLI * np.array(values)
    return found


def _points(machine: Machine, curves: Curves) -> list[tuple[Cell, ...]]:
    """One row for each corner, beside the reference where there is one."""
    rows: list[tuple[Cell, ...]] = []
    for (model, turn), values in curves.items():
        for speed, (error, over) in zip(ALL_SPEEDS, values.tolist(), strict=True):
            known = SINGLE.get((model, turn)) if machine.name == "yin2018" else None
            reference = known[SPEEDS.index(speed)] if known and speed in SPEEDS else None
            rows.append((turn, speed, model, error, over, reference))
    return rows


def straight_line(values: Array) -> tuple[float, float, float]:
    """Slope, value at rest and r squared of values (speeds,) over `ALL_SPEEDS`."""
    if not np.all(np.isfinite(values)):
        return (float("nan"),) * 3
    slope, rest = np.polyfit(ALL_SPEEDS, values, 1)
    left = values - slope * np.array(ALL_SPEEDS) - rest
    spread = ((values - values.mean()) ** 2).sum()
    return float(slope), float(rest), float(1 - (left**2).sum() / spread) if spread else 1.0


def _lines(curves: Curves, turn: str) -> dict[str, Array]:
    """What is drawn for a turn: both models and their discrepancy [mm]."""
    lines = {model: curves[model, turn][:, 0] for model in MODELS}
    return lines | {GAP: lines["full"] - lines["4-DoF"]}


def _fits(curves: Curves) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for turn in TURNS:
        for name, values in _lines(curves, turn).items():
            if name != "ideal":
                rows.append((turn, name, *straight_line(values)))
    return rows


def _short(curves: Curves) -> list[tuple[Cell, ...]]:
    """What both 4-DoF models miss of the full model's error, relative."""
    rows: list[tuple[Cell, ...]] = []
    for turn in TURNS:
        for i, speed in enumerate(ALL_SPEEDS):
            full = float(curves["full", turn][i, 0])
            models = [float(curves[m, turn][i, 0]) for m in ("4-DoF", "condensed")]
            rows.append((turn, speed, *(m / full - 1 if full > 0 else None for m in models)))
    return rows


def _draw(figure: Figure, curves: Curves) -> None:
    """One panel for each turn."""
    speeds = MILLI * np.array(ALL_SPEEDS)
    for axes, turn in zip(figure.subplots(1, 2, sharey=True), TURNS, strict=True):
        for name, values in _lines(curves, turn).items():
            colour = COLOURS.get(name, "#2a9d3a")
            slope, rest, _ = straight_line(values)
            axes.plot(speeds, values, "o", color=colour, markersize=4, label=name)
            axes.plot(speeds, slope * speeds / MILLI + rest, "-", color=colour, linewidth=0.8)
        axes.set_title(turn, fontsize=9)
        axes.set_xlabel("speed [mm/s]")
        axes.legend(fontsize=8)
    figure.axes[0].set_ylabel("contour error [mm]")
