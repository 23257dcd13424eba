"""What a reproduction leaves: tables as JSON and Markdown, beside its figure."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from corexy_fmi.files import write_beside

Cell = str | float | int | bool | None
LINE = 120  # characters of the label in a line
NOTHING = 1e-9  # mm mostly
SVG: Any = {"svg.hashsalt": "corexy_fmi", "svg.fonttype": "none", "font.size": 9.0}


@dataclass(frozen=True)
class Table:
    """A table: what it shows, its columns with units, its rows."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def records(self) -> list[dict[str, Cell]]:
        """The rows by column; what is not finite is None."""
        return [dict(zip(self.head, map(_plain, row), strict=True)) for row in self.rows]


@dataclass(frozen=True)
class Result:
    """One figure or study: name of its files, title, the label of its machine, tables, notes."""

    name: str
    title: str
    label: str
    command: str
    tables: tuple[Table, ...]
    notes: tuple[str, ...] = ()
    draw: Callable[[Figure], None] | None = None

    def document(self) -> dict[str, Any]:
        """All of it as plain data."""
        tables = [{"title": t.title, "rows": t.records()} for t in self.tables]
        return {
            "name": self.name,
            "title": self.title,
            "label": self.label,
            "command": self.command,
            "notes": list(self.notes),
            "tables": tables,
        }


def markdown(document: dict[str, Any], level: int = 1) -> str:
    """A result's document as Markdown, its title a heading of that level."""
    lines = [f"{'#' * level} {document['title']}", "", f"{document['label']}.", ""]
    lines += [f"`{document['command']}`", ""]
    for table in document["tables"]:
        lines += [f"{table['title']}:", "", *_rows(table["rows"]), ""]
    lines += [f"- {note}" for note in document["notes"]]
    return "\n".join(lines).rstrip() + "\n"


def write_result(result: Result, folder: Path) -> list[Path]:
    """Write NAME.json, NAME.md and NAME.svg; raises InputError where that cannot be."""
    document = result.document()
    texts = {
        "json": json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        "md": markdown(document),
    }
    paths = [folder / f"{result.name}.{ending}" for ending in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        with write_beside(path) as beside:
            beside.write_text(text, encoding="utf-8")
    return paths + ([_picture(result, folder)] if result.draw else [])


def _picture(result: Result, folder: Path) -> Path:
    """The figure with its label beneath the title."""
    path = folder / f"{result.name}.svg"
    with rc_context(SVG):
        figure = Figure(figsize=(9, 5.5), layout="constrained")
        figure.suptitle("\n".join([result.title, *wrap(result.label, LINE)]), fontsize=8)
        assert result.draw is not None
        result.draw(figure)
        with write_beside(path) as beside:
            figure.savefig(beside, metadata={"Date": None})
    return path


def shown(cell: Cell) -> str:
    """A cell as text: four digits, yes or no, a dash for nothing."""
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if cell is None or (isinstance(cell, float) and not math.isfinite(cell)):
        return "-"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _rows(records: Sequence[dict[str, Cell]]) -> list[str]:
    lines = [list(records[0]), ["---"] * len(records[0])]
    lines += [[shown(cell) for cell in record.values()] for record in records]
    return [f"| {' | '.join(line)} |" for line in lines]


def _plain(cell: Cell) -> Cell:
    """Six digits, nothing below `NOTHING`: what is less is the rounding of another processor."""
    if not isinstance(cell, float):
        return cell
    if not math.isfinite(cell):
        return None
    return 0.0 if abs(cell) < NOTHING else float(f"{cell:.6g}")
