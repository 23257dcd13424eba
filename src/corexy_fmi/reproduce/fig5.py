"""Fig. 5: contour error against relative mass, stiffness and friction, 0.5 to 2."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from corexy_fmi.machine import Machine
from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce.fig3 import MILLI
from corexy_fmi.reproduce.measure import MIDDLE, exponents
from corexy_fmi.reproduce.paper import EXPONENTS, label
from corexy_fmi.reproduce.plant import plant
from corexy_fmi.reproduce.result import Cell, Result, Table
from corexy_fmi.reproduce.sets import GROUPS, scaled

FACTORS = (0.5, 0.7, 1.0, 1.4, 2.0)
STYLES = {"mass": "#2a9d3a", "stiffness": "#d95f02", "friction": "#1f5fbf"}
SHOWN = ("full", "4-DoF")
HEAD = ("turn", "model", "scaled", "factor", "error [mm]", "relative error")
SLOPES = ("turn", "model", "scaled", "exponent", "reference")
Array = NDArray[np.float64]
Curves = Mapping[tuple[str, str, str], Array]  # turn, model, group to errors [mm]


def fig5(machine: Machine, report: Callable[[str, float], None]) -> Result:
    """Run and tabulate single corners at 39 mm/s."""
    curves = _curves(machine, report)
    return Result(
        name="fig5",
        title="Fig. 5: contour error, eq. (17), at 39 mm/s against scaled parameters",
        label=label(machine),
        command=f"corexy reproduce fig5 --machine {machine.name}",
        tables=(
            Table("Exponents, error ~ factor^exponent", SLOPES, tuple(_slopes(machine, curves))),
            Table("Corners through the FMU", HEAD, tuple(_points(curves))),
        ),
        notes=(
            "mass: carriage, bridge, pulleys and their inertia; friction: viscous and Coulomb, all",
            "reference: the project's specification, P1, from x to y",
        ),
        draw=lambda figure: _draw(figure, curves),
    )


def _curves(machine: Machine, report: Callable[[str, float], None]) -> Curves:
    """Errors over the factors, for every turn, model and group."""
    found: dict[tuple[str, str, str], Array] = {}
    keys = [(turn, model, group) for turn in TURNS for model in SHOWN for group in GROUPS]
    with plant(machine) as stage:
        for key in keys:
            turn, model, group = key
            report(" ".join(key), len(found) / len(keys))
            sets = [scaled(machine.parameters, group, factor) for factor in FACTORS]
            values = [stage.corner(turn, MIDDLE, model, p)[0] for p in sets]
            found[key] = MILLI * np.array(values)
    return found


def _slopes(machine: Machine, curves: Curves) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for (turn, model, group), values in curves.items():
        known = machine.name == "yin2018" and turn == "x->y" and model == "full"
        slope = float(exponents(FACTORS, values[None])[0])
        rows.append((turn, model, group, slope, EXPONENTS[group] if known else None))
    return rows


def _points(curves: Curves) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for key, values in curves.items():
        nominal = float(values[FACTORS.index(1.0)])
        for factor, error in zip(FACTORS, values.tolist(), strict=True):
            rows.append((*key, factor, error, error / nominal if nominal else None))
    return rows


def _draw(figure: Figure, curves: Curves) -> None:
    """One panel for each turn; dashed the 4-DoF model."""
    for axes, turn in zip(figure.subplots(1, 2), TURNS, strict=True):
        for group, colour in STYLES.items():
            for model, style in zip(SHOWN, ("o-", "o--"), strict=True):
                values = curves[turn, model, group]
                name = f"{group}, {model}"
                axes.plot(FACTORS, values, style, color=colour, markersize=3, label=name)
        axes.set_title(turn, fontsize=9)
        axes.set_xlabel("factor")
        axes.legend(fontsize=7)
    figure.axes[0].set_ylabel("contour error [mm]")
