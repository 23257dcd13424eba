"""What a page of results shows on demand only."""

from __future__ import annotations


def folded(summary: str, lines: list[str]) -> list[str]:
    """Lines of Markdown behind a summary that opens them."""
    return ["<details>", f"<summary>{summary}</summary>", "", *lines, "", "</details>"]
