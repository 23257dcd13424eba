"""The figures of docs/speed.md."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from corexy_fmi.reproduce.result import SVG

IMAGES = Path(__file__).parents[1] / "docs" / "images" / "speed"
LOOKS = {  # beginning of a peer's name: colour, marker
    "this kernel, 1": ("#d62728", "*"),
    "this kernel, 8": ("#7f0000", "*"),
    "this kernel, other": ("#d62728", "."),
    "numba": ("#1f77b4", "s"),
    "CasADi": ("#9467bd", "D"),
    "NumPy": ("#8c564b", "v"),
    "MuJoCo": ("#2ca02c", "o"),
    "SciPy": ("#ff7f0e", "^"),
}


def draw(stored: Mapping[str, Any]) -> None:
    """Both figures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    with rc_context(SVG):
        _save(_peers(stored["machines"]), "peers.svg")
        _save(_costs(stored["costs"]), "costs.svg")


def _peers(machines: list[dict[str, Any]]) -> Figure:
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    row = figure.subplots(1, len(machines), sharey=True, squeeze=False)[0]
    for axes, one in zip(row, machines, strict=True):
        for begin, (colour, marker) in LOOKS.items():
            points = [p for p in one["points"] if p["peer"].startswith(begin) and p["seconds"]]
            x, y = ([p[key] for p in points] for key in ("seconds", "error_um"))
            axes.loglog(x, y, marker, color=colour, label=begin, markersize=6, alpha=0.8)
        named = ", surrogate" if one["surrogate"] else ""
        axes.set(title=f"{one['machine']}{named}", xlabel="one run of the rectangle [s]")
        axes.set_ylim(top=1e3)
        axes.grid(alpha=0.3)
    row[0].set(ylabel="largest error [um]")
    row[-1].legend(fontsize=7, loc="upper right")
    return figure


def _costs(costs: Mapping[str, Any]) -> Figure:
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    sets, length, effects = figure.subplots(1, 3)
    _line(sets, costs["over_sets"], 1e3, "parameter sets in a call", "one call [ms]")
    sets.set(xscale="log", yscale="log")
    _line(length, costs["over_length"], 1e3, "simulated time [s]", "one lane [ms]")
    for key, word in (("one_lane", "one lane"), ("of_eight_lanes", "of eight lanes")):
        values = {n: row[key] for n, row in costs["over_effects"].items()}
        _line(effects, values, 1.0, "effects switched on", "a step [ns]", word)
    effects.legend()
    return figure


def _line(
    axes: Axes, values: Mapping[str, float], scale: float, x: str, y: str, label: str = ""
) -> None:
    places = np.array([float(n) for n in values])
    axes.plot(places, scale * np.array(list(values.values())), ".-", label=label)
    axes.set(xlabel=x, ylabel=y)
    axes.grid(alpha=0.3)


def _save(figure: Figure, name: str) -> None:
    figure.savefig(IMAGES / name, metadata={"Date": None})
