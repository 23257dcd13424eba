"""The engine's threshold, temperature and ceiling against what the proof's cases say of them.

The cases that development saw (the earlier runs of the proof) set them; the seeds of `make blind`
and the last run, whose engines had them already, judge.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from scipy.stats import binomtest

from benchmarks.concealed.calibration import brier, named, rate
from corexy_fmi.engine.naming.entries import CEILING, TEMPERATURE, THRESHOLD

Entry = dict[str, Any]
Pairs = list[tuple[float, bool]]  # what was said, and whether it was so
TEMPERATURES = (1.0, 2.0, 3.0, 4.0, 6.0, 12.0)
LEVELS = (0.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # [nats]
EDGES = (0.0, 0.5, 0.8, 0.95, 1.0)  # of the diagram's bins
DIAGRAM = Path("docs/reliability.svg")


def null_maxima(entries: list[Entry]) -> list[float]:
    """The most that any effect or law at any place gains [nats], penalty paid, where nothing is
    planted; 0 where all of them lose.
    """
    nulls = [e["document"] for e in entries if e["truth"]["kind"] == "null"]
    return sorted(max(d["gain"], 0.0) for d in nulls if "gain" in d)


def sure(entries: list[Entry]) -> tuple[int, int]:
    """Of the verdicts `explained`, whatever was planted: how many are right, and how many."""
    found = [e["outcome"] for e in entries if e["document"]["verdict"] == "explained"]
    return sum(outcome == "right" for outcome in found), len(found)


def tempered(pairs: Pairs, temperature: float) -> Pairs:
    """What would be said at another temperature, one rival against the winner, to the ceiling."""
    said = np.clip([p for p, _ in pairs], 1e-9, 1 - 1e-9)
    odds = np.log(said / (1 - said)) * TEMPERATURE / temperature
    told = np.minimum(1 / (1 + np.exp(-odds)), CEILING)
    return [(float(p), right) for p, (_, right) in zip(told, pairs, strict=True)]


def log_loss(pairs: Pairs) -> float:
    """Mean of -log of what was said of what came out [nats]."""
    return float(np.mean([-np.log(p if right else 1 - p) for p, right in pairs]))


def diagram(development: Pairs, judged: Pairs, path: Path = DIAGRAM) -> None:
    """The reliability diagram, Wilson 95 %: how often what is said is so."""
    figure = Figure(figsize=(4.5, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.plot((0, 1), (0, 1), color="0.7", linewidth=1)
    groups = (("development", development, "0.45"), ("judged", judged, "C0"))
    for name, pairs, colour in groups:
        told = tempered(pairs, TEMPERATURE)
        for n, (low, high) in enumerate(pairwise(EDGES)):
            inside = [(p, right) for p, right in told if low < p <= high]
            if not inside:
                continue
            hits, count = sum(right for _, right in inside), len(inside)
            interval = binomtest(hits, count).proportion_ci(method="wilson")
            at = float(np.mean([p for p, _ in inside]))
            off = [[max(hits / count - interval.low, 0)], [max(interval.high - hits / count, 0)]]
            label = name if n == len(EDGES) - 2 else None
            axes.errorbar(at, hits / count, off, fmt="o", color=colour, label=label, capsize=3)
    axes.set(xlabel="probability said of the cause", ylabel="share of cases where it is the cause",
             xlim=(0, 1.02), ylim=(0, 1.02))  # fmt: skip
    axes.legend(frameon=False, loc="upper left")
    path.parent.mkdir(parents=True, exist_ok=True)
    with rc_context({"svg.hashsalt": "reliability"}):
        figure.savefig(path, metadata={"Date": None})


def section(development: list[Entry], judged: list[Entry]) -> list[str]:
    """Lines of RESULTS.md, and the diagram beside them."""
    groups = [e for e in (development, judged) if named(e)]
    if len(groups) < 2:
        return []
    diagram(named(development), named(judged))
    return [
        "## Threshold, temperature, ceiling",
        "",
        "Set on the cases of all earlier runs of the proof (development), judged on the seeds of "
        "`make blind` and on the run above.",
        "",
        *_threshold(development, judged),
        *_ceiling(development, judged),
        *_temperature(named(development), named(judged)),
        f"![How often what is said is so]({DIAGRAM})",
        "",
    ]


def _threshold(development: list[Entry], judged: list[Entry]) -> list[str]:
    lines = [
        f"**Threshold** ({THRESHOLD:g} nats beyond half of log n a parameter): the maximum over "
        "all (effect, place) pairs and laws where nothing is planted, nuisances of all kinds on. "
        "What is far above it was no chance but physics or numerics that the engine of the day "
        "lacked.",
        "",
        f"| nulls | n | {' | '.join(f'above {level:g}' for level in LEVELS)} | largest | above "
        f"{THRESHOLD:g} [Wilson 95 %] |",
        "|---|---|" + "---|" * (len(LEVELS) + 2),
    ]
    for name, entries in (("development", development), ("judged", judged)):
        found = null_maxima(entries)
        if found:
            counts = [sum(g > level for g in found) for level in LEVELS]
            false = rate(sum(g > THRESHOLD for g in found), len(found))
            cells = [name, len(found), *counts, f"{found[-1]:.1f}", false]
            lines.append(f"| {' | '.join(map(str, cells))} |")
    return [*lines, ""]


def _ceiling(development: list[Entry], judged: list[Entry]) -> list[str]:
    ours, theirs = (rate(*sure(e)) for e in (development, judged))
    return [
        f"**Ceiling** ({CEILING:g}): of the verdicts `explained`, whatever was planted, pairs and "
        f"causes outside the catalogue among it, right: development {ours}, judged {theirs}. No "
        "probability is told above it.",
        "",
    ]


def _temperature(development: Pairs, judged: Pairs) -> list[str]:
    lines = [
        f"**Temperature** ({TEMPERATURE:g}) of the log evidence: log loss and Brier score of the "
        "leading cause of cases with one effect, by what would be said at another temperature.",
        "",
        "| temperature | development: log loss | Brier | judged: log loss | Brier |",
        "|---|---|---|---|---|",
    ]
    for t in TEMPERATURES:
        cells = [
            f"{f(tempered(p, t)):.3f}" for p in (development, judged) for f in (log_loss, brier)
        ]
        lines.append(f"| {t:g} | {' | '.join(cells)} |")
    return [*lines, ""]
