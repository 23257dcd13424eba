"""Matplotlib figures as inline SVG whose colours follow the page, light or dark.

A figure is drawn with stand-in colours (``#0000nn``); in the SVG each becomes the CSS variable of
the page that it stands for.  Text stays text in the page's font, one SVG unit is one CSS pixel.
Figures hold no text from a recording or machine file; that belongs into the caption.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import matplotlib
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure

HEAT = tuple(f"heat{i}" for i in range(6))
CURVES = ("measured", "nominal", "retuned", "explained")
NAMES = ("ink", "muted", "rule", *CURVES, "band", "span", *HEAT)
INK = {name: f"#0000{i + 1:02x}" for i, name in enumerate(NAMES)}
SETTINGS = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "DejaVu Sans",
    "font.size": 10.5,
    "axes.labelsize": 10.5,
    "xtick.labelsize": 10,
    "ytick.labelsize": 10,
    "axes.edgecolor": INK["rule"],
    "axes.labelcolor": INK["muted"],
    "axes.linewidth": 1,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": INK["rule"],
    "grid.linewidth": 0.6,
    "xtick.color": INK["rule"],
    "ytick.color": INK["rule"],
    "xtick.labelcolor": INK["muted"],
    "ytick.labelcolor": INK["muted"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
}


@dataclass
class Drawing:
    """A figure in the making; ``svg`` is filled when the drawing is finished."""

    figure: Figure
    axes: Axes
    svg: Markup = field(default_factory=Markup)


@contextmanager
def drawing(key: str, label: str, width: int = 430, height: int = 260) -> Iterator[Drawing]:
    """One axes of a size in CSS pixels; ``key`` is unique on the page, ``label`` its alt text."""
    settings: Any = SETTINGS | {"svg.hashsalt": key}
    with matplotlib.rc_context(settings):
        figure = Figure(figsize=(width / 72, height / 72), dpi=72, layout="constrained")
        made = Drawing(figure, figure.add_subplot())
        yield made
        made.svg = _inline(figure, label, width, height)


def _inline(figure: Figure, label: str, width: int, height: int) -> Markup:
    """The figure as an ``<svg>`` element for an HTML page, without prolog, style sheet or URL."""
    sheet = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Type", "Format"))
    with warnings.catch_warnings():  # beside a stray sample of 1 km a path has no height
        warnings.filterwarnings("ignore", "Attempting to set identical low and high")
        figure.savefig(sheet, format="svg", metadata=nothing, transparent=True)
    body = sheet.getvalue().split("</defs>", 1)[1].rsplit("</svg>", 1)[0]
    body = re.sub(r'<g id="[^"]*">', "<g>", body)
    body = re.sub(r"font-family: [^;\"]*; ?", "", body)
    body = re.sub(r" *\n *", "\n", body)
    for name, stand_in in INK.items():
        body = body.replace(stand_in, f"var(--{name})")
    head = f'viewBox="0 0 {width} {height}" style="max-width:{round(width * 1.26)}px"'
    return Markup(f'<svg {head} role="img" aria-label="{escape(label)}">{body}</svg>')
