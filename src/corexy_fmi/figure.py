"""Figure of a rectangle run like the paper's Fig. 3: ideal and simulated path, one corner near."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from corexy_fmi.corners import Corner
from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle

if TYPE_CHECKING:  # matplotlib takes a quarter of a second, and most commands draw nothing
    from matplotlib.axes import Axes

IDEAL, SIMULATED = "#888888", "#1f5fbf"
MILLI = 1e3  # [mm/m]


def draw_rectangle(
    recording: Recording, shape: Rectangle, corners: Sequence[Corner], machine: Machine, path: Path
) -> None:
    """Draw the whole path and, beside it, the corner with the largest error; axes in mm.

    The ending of ``path`` chooses the format; raises InputError for an unknown one.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="constrained")
    check_format(path)
    whole, near = figure.subplots(1, 2)
    about = fill(machine.surrogate, 120)
    figure.suptitle(f"{machine.name} at {MILLI * shape.speed:g} mm/s\n{about}".strip())
    for axes in (whole, near):
        _paths(axes, recording, shape)
    if corners:
        worst = max(corners, key=lambda corner: np.nan_to_num(abs(corner.contour_error)))
        _zoom(near, shape, worst)
    whole.legend(loc="center")
    with write_beside(path) as beside:
        figure.savefig(beside, dpi=150)


def check_format(path: Path) -> None:
    """Raises InputError where the ending names no format of a figure."""
    from matplotlib.figure import Figure

    known = Figure().canvas.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise InputError(f"{path}: unknown ending {path.suffix!r}, expected .png, .svg or .pdf")


def _paths(axes: Axes, recording: Recording, shape: Rectangle) -> None:
    """Ideal and simulated path."""
    ideal = MILLI * shape.vertices
    axes.plot(ideal[:, 0], ideal[:, 1], color=IDEAL, linestyle="--", label="ideal")
    x, y = MILLI * recording["x"], MILLI * recording["y"]
    axes.plot(x, y, color=SIMULATED, linewidth=1.2, label="simulated")
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _zoom(axes: Axes, shape: Rectangle, corner: Corner) -> None:
    """Show the neighbourhood of one corner."""
    x, y = MILLI * shape.vertices[corner.number]
    span = MILLI * max(4 * max(abs(corner.contour_error), corner.overshoot), 1e-5)
    span = min(span, MILLI * min(shape.width, shape.height) / 2) if np.isfinite(span) else 1.0
    axes.set_xlim(x - span, x + span)
    axes.set_ylim(y - span, y + span)
    error = f"{MILLI * corner.contour_error:.3f} mm by eq. (17)"
    axes.set_title(f"corner {corner.number}, {corner.turn}: {error}")
