"""The x-y plane: the paths, one corner from near, and the mismatch on the path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from corexy_fmi.engine.evidence import Array, Trace
from corexy_fmi.report.corner import Window, distance
from corexy_fmi.report.decimate import outline, rms_per_cell
from corexy_fmi.report.figures import MODELS, mismatch
from corexy_fmi.report.ink import HEAT, INK, drawing
from corexy_fmi.report.quantities import prefix_for

SIDE = 430  # pixels
STYLES: dict[str, dict[str, Any]] = {
    "nominal": {"linewidth": 1.3},
    "retuned": {"linewidth": 1.5},
    "measured": {"linewidth": 2.6, "alpha": 0.9},
    "explained": {"linewidth": 1.5, "linestyle": (0, (4, 2))},  # lies on the measured one if right
}


def has_plane(trace: Trace) -> bool:
    """Whether the end-effector's position was measured in both axes."""
    return all(mismatch(trace, channel, "retuned") is not None for channel in "xy")


def plane_figure(trace: Trace, window: Window | None, key: str) -> Markup:
    """Measured, nominal, retuned and explained path, and the square that is shown from near."""
    scale, unit = _path_scale(trace)
    with drawing(key, "Paths in the x-y plane", SIDE, _height(trace)) as made:
        for name, x, y in _paths(trace):
            line = outline(x, y)
            made.axes.plot(line[0] * scale, line[1] * scale, color=INK[name], linewidth=1.2)
        _square_axes(made.axes, unit)
        if window:
            _mark(made.axes, window.x * scale, window.y * scale, window.half * scale)
    return made.svg


def corner_figure(trace: Trace, window: Window, key: str) -> Markup:
    """The corner from near, one pass; coordinates count from the commanded corner."""
    scale, unit = prefix_for(window.half, "m")
    rows, limit = window.rows, 1.02 * window.half * scale
    with drawing(key, "One corner from near", SIDE, SIDE) as made:
        command = ((trace.x_ref[rows] - window.x) * scale, (trace.y_ref[rows] - window.y) * scale)
        made.axes.plot(*command, color=INK["muted"], linewidth=1, linestyle=(0, (1, 2.5)))
        for name, x, y in _paths(trace):
            taken = np.isfinite(x[rows]) & np.isfinite(y[rows])
            near_x = (x[rows][taken] - window.x) * scale
            near_y = (y[rows][taken] - window.y) * scale
            made.axes.plot(near_x, near_y, color=INK[name], **STYLES[name])
        _square_axes(made.axes, unit, "from the corner ")
        made.axes.set_aspect("equal", adjustable="box")
        made.axes.set(xlim=(-limit, limit), ylim=(-limit, limit))
    return made.svg


def heat_figure(trace: Trace, model: str, edges: Sequence[float], key: str) -> Markup:
    """The measured path, coloured by its distance from a model; ``edges`` [m] part the colours."""
    scale, unit = _path_scale(trace)
    x, y, size = _cells(trace, model)
    colours = [INK[HEAT[i]] for i in np.searchsorted(edges, size)]
    with drawing(
        key, f"Mismatch of the {model} machine on the path, coloured by size", SIDE, _height(trace)
    ) as made:
        if len(size):
            made.axes.scatter(x * scale, y * scale, s=14, c=colours, marker="s", linewidths=0)
        _square_axes(made.axes, unit)
    return made.svg


def heat_edges(trace: Trace) -> list[float]:
    """Five sizes [m] that part six colours, the same for all models of a recording."""
    size = _cells(trace, "retuned")[2]
    top = float(np.quantile(size, 0.98)) if len(size) else 0.0
    return [top * (i + 1) / 6 for i in range(5)]


def _cells(trace: Trace, model: str) -> tuple[Array, Array, Array]:
    """Where the path was measured, in cells [m], and the rms distance from a model there [m]."""
    return rms_per_cell(trace.measured["x"], trace.measured["y"], distance(trace, model))


def _height(trace: Trace) -> int:
    """Height [pixels] of a figure whose width is ``SIDE`` and whose axes hold the path."""
    wide, high = (float(np.ptp(v[np.isfinite(v)])) for v in (trace.measured[c] for c in "xy"))
    return round(60 + (SIDE - 60) * float(np.clip(1.04 * high / max(wide, 1e-9), 0.35, 1.0)))


def _path_scale(trace: Trace) -> tuple[float, str]:
    """Scale and unit of positions along the path."""
    largest = max(float(np.nanmax(np.abs(trace.measured[name]))) for name in "xy")
    return prefix_for(largest or 1e-3, "m")


def _paths(trace: Trace) -> list[tuple[str, Array, Array]]:
    """The paths that exist, the measured one above the given and under the explained."""
    maps = {m: getattr(trace, m) for m in MODELS} | {"measured": trace.measured}
    order = ("nominal", "retuned", "measured", "explained")
    return [
        (name, maps[name]["x"], maps[name]["y"]) for name in order if {"x", "y"} <= set(maps[name])
    ]


def _mark(axes: Axes, x: float, y: float, half: float) -> None:
    """A square around the corner, never too small to be seen."""
    low, high = axes.get_xlim()
    half = max(half, 0.03 * (high - low))
    square = Rectangle((x - half, y - half), 2 * half, 2 * half, fill=False, edgecolor=INK["ink"])
    axes.add_patch(square)


def _square_axes(axes: Axes, unit: str, prefix: str = "") -> None:
    """The same scale both ways, titles with units."""
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x {prefix}[{unit}]")
    axes.set_ylabel(f"y {prefix}[{unit}]")
