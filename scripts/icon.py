"""Draw the FMU's icon, ``fmu_src/model.png``: ``python scripts/icon.py``.

Two belts around eight pulleys, motors below, the bridge with its carriage in the middle.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch

ICON = Path(__file__).parents[1] / "fmu_src" / "model.png"
SIZE = 128  # [pixels] of a side
BELTS = {
    "#1f77b4": ((1.5, 1.5), (1.5, 8.5), (8, 8.5), (8, 5.3), (2.0, 5.3), (2.0, 1.5)),
    "#d62728": ((8.5, 1.5), (8.5, 8.9), (2, 8.9), (2, 4.7), (8.0, 4.7), (8.0, 1.5)),
}


def draw() -> Figure:
    """The figure, transparent outside its lines."""
    figure = Figure(figsize=(1, 1), dpi=SIZE)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 10), ylim=(0, 10))
    axes.set_axis_off()
    axes.add_patch(FancyBboxPatch((1.2, 4.4), 7.6, 1.2, boxstyle="round", fc="#ddd", ec="#444"))
    for colour, corners in BELTS.items():
        axes.plot(*zip(*corners, corners[0], strict=True), color=colour, lw=1.2)
        for place in corners[1:5]:
            axes.add_patch(Circle(place, 0.35, fc="white", ec=colour))
        axes.add_patch(Circle(corners[0], 0.9, fc=colour, ec="#444", zorder=3))
    axes.add_patch(FancyBboxPatch((4.2, 4.1), 1.6, 1.8, boxstyle="round", fc="#444", zorder=4))
    return figure


if __name__ == "__main__":
    draw().savefig(ICON, transparent=True, metadata={"Software": None})
