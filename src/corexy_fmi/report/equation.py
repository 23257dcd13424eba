"""A LaTeX equation as one SVG path; escaped text where it cannot be set."""

from __future__ import annotations

import re
from functools import lru_cache

from markupsafe import Markup, escape
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath

LONGEST = 1000  # characters; more is no equation
LETTERS = {
    Path.MOVETO: "M",
    Path.LINETO: "L",
    Path.CURVE3: "Q",
    Path.CURVE4: "C",
    Path.CLOSEPOLY: "Z",
}
# what LaTeX writes and mathtext calls otherwise
SPELLINGS = (
    (r"\\text(?:rm|normal|it)?\s*\{", r"\\mathrm{"),
    (r"\\[dt]frac", r"\\frac"),
    (r"\\[lr]vert(?![A-Za-z])", "|"),
    (r"\\operatorname\*?\{", r"\\mathrm{"),
    (r"\\bigl?|\\bigr|\\Bigl?|\\Bigr", ""),
    (r"~", r"\\ "),
)


@lru_cache(maxsize=64)
def typeset(latex: str, size: float = 19.0) -> Markup:
    """The equation as inline SVG in the colour of the text around it."""
    outline = _outline(latex, size)
    if outline is None:
        return Markup(f'<code class="equation">{escape(latex)}</code>')
    box = outline.get_extents()
    left, top = box.x0 - 1, -box.y1 - 1
    width, height = box.width + 2, box.height + 2
    commands = " ".join(
        _command(points, code) for points, code in outline.iter_segments(simplify=False)
    )
    return Markup(
        f'<svg class="equation" viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}" '
        f'style="width:{width:.0f}px" role="img" aria-label="{escape(latex)}">'
        f'<path fill="currentColor" d="{commands}"/></svg>'
    )


def _outline(latex: str, size: float) -> TextPath | None:
    """Glyph outlines, or None for what mathtext does not know."""
    text = latex.strip().strip("$").replace("\n", " ")
    if not text or len(text) > LONGEST or "$" in text or not text.isascii():
        return None
    for pattern, spelling in SPELLINGS:
        text = re.sub(pattern, spelling, text)
    try:
        made = TextPath((0, 0), f"${text}$", size=size, prop=FontProperties(math_fontfamily="cm"))
    except (ValueError, RecursionError, RuntimeError, KeyError):
        return None
    return made if len(made.vertices) else None


def _command(points: object, code: object) -> str:
    """One piece of a path in SVG's letters, y downwards."""
    flat = [float(v) for v in points]  # type: ignore[attr-defined]
    letter = LETTERS[code]  # type: ignore[index]
    if letter == "Z":
        return "Z"
    return letter + " ".join(f"{v if i % 2 == 0 else -v:.2f}" for i, v in enumerate(flat))
