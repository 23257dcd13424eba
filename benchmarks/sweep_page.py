"""The figures of docs/sweep.md: what was measured, and what is worked out from it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.outcome import RESULTS

PAGE = Path(__file__).parents[1] / "docs" / "sweep.md"
BEGIN, END = "<!-- figures: python -m benchmarks.sweep --render -->", "<!-- end of figures -->"
ESTIMATED = (10, 100, 1000)
JOBS = (10**6, 10**9)
SOURCE = "https://docs.dask.org/en/latest/best-practices.html"
OVERHEAD = (200e-6, 1e-3)  # [s] a task of Dask's scheduler, as its documentation has it


BUSY = (
    "The machine was busy with other work on its cores: the rates are too low, and what two cores "
    "gave over one says nothing about scaling. Scaling over cores is not measured."
)


def ceiling(row: Mapping[str, float]) -> float:
    """Sets per second that one collecting process can take, at a size of chunks."""
    return row["sets"] / (row["write"] + row["hand_over"])


def figures(found: Mapping[str, Any]) -> str:
    """Markdown of the figures."""
    one = found["sweeps"][0]["sets_per_second"]
    return "\n".join(
        [
            BEGIN,
            "",
            f"Measured by `{found['command']}` at commit `{found['commit']}` on "
            f"{found['cpu']}, {len(found['sweeps'])} cores "
            f"(load average before: {found['load_average_before']:.1f}): {found['sets']} sets "
            f"of {found['machine']}, {found['rectangle']} ({found['rows']} rows), "
            f"{len(found['vary'])} numbers varied, {found['chunk']} sets a chunk.",
            "",
            *_measured(found),
            "",
            *([BUSY, ""] if found["load_average_before"] > 0.5 else []),
            *_collecting(found, one),
            "",
            *_estimate(found, one),
            "",
            END,
        ]
    )


def _measured(found: Mapping[str, Any]) -> list[str]:
    one = found["sweeps"][0]["sets_per_second"]
    rows = [
        f"| {s['cores']} | {s['sets_per_second']:,.0f} | {s['sets_per_second'] / one:.2f} | "
        f"{s['seconds_to_start']:.1f} | {s['bytes_per_set']:.0f} |"
        for s in found["sweeps"]
    ]
    head = "| cores | sets/s | times one core | start (s) | bytes/set |"
    return [head, "|---|---|---|---|---|", *rows]


def _collecting(found: Mapping[str, Any], one: float) -> list[str]:
    """What the collecting process takes, and how many cores that is."""
    rows = [
        f"| {int(c['sets'])} | {1e3 * c['hand_over']:.2f} | {1e3 * c['write']:.2f} | "
        f"{ceiling(c):,.0f} | {ceiling(c) / one:,.0f} |"
        for c in found["collecting"]
    ]
    head = "| sets a chunk | hand over (ms) | write (ms) | at most sets/s | that many cores |"
    return ["The one process that collects:", "", head, "|---|---|---|---|---|", *rows]


def _estimate(found: Mapping[str, Any], one: float) -> list[str]:
    """A thousand cores, from one core's rate and the collector's ceiling."""
    most = max(ceiling(row) for row in found["collecting"])
    rows = []
    for cores in ESTIMATED:
        cells = [f"{one * cores:,.0f}", f"{min(one * cores, most):,.0f}"]
        for sets in JOBS:
            seconds, chunk = fastest(found, one, cores, sets)
            cells.append(
                f"{seconds:.2g} s, chunks of {chunk}"
                if seconds < 100
                else f"{seconds:,.0f} s, chunks of {chunk}"
            )
        rows.append(f"| {cores} | {' | '.join(cells)} |")
    return [
        "**Estimate, not measured**: every core as fast as the one above, workers already started, "
        "no network; the best of these sizes of chunks; a million sets are few chunks.",
        "",
        "| cores | workers alone, sets/s | with one collector, sets/s | 10^6 sets | 10^9 sets |",
        "|---|---|---|---|---|",
        *rows,
        "",
        *(_scheduler(row, one) for row in found["collecting"]),
    ]


def fastest(found: Mapping[str, Any], one: float, cores: int, sets: int) -> tuple[float, int]:
    """Seconds for so many sets, and the size of chunks with which: rounds, or the collector."""
    times = []
    for row in found["collecting"]:
        chunks = math.ceil(sets / row["sets"])
        working = math.ceil(chunks / cores) * row["sets"] / one
        cost = row["write"] + row["hand_over"]
        times.append((max(working + cost, chunks * cost), int(row["sets"])))
    return min(times)


def _scheduler(row: Mapping[str, float], one: float) -> str:
    """How busy Dask's scheduler would be with a thousand cores."""
    tasks = ESTIMATED[-1] * one / row["sets"]
    low, high = (100 * overhead * tasks for overhead in OVERHEAD)
    return (
        f"- A thousand cores, chunks of {int(row['sets'])}: {tasks:,.0f} tasks a second; at the "
        f"0.2 to 1 ms a task that [Dask's documentation]({SOURCE}) gives, its scheduler would be "
        f"busy {low:.0f} to {high:.0f} % of the time."
    )


def outcome() -> dict[str, Any]:
    """The stored figures."""
    return dict(json.loads((RESULTS / "sweep.json").read_text(encoding="utf-8")))


def rendered() -> str:
    """The page with its figures renewed."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    return before + figures(outcome()) + rest.partition(END)[2]


def render() -> Path:
    """Write the page."""
    PAGE.write_text(rendered(), encoding="utf-8", newline="\n")
    return PAGE
