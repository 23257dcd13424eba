"""docs/rivals.md out of the results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

ORDER = (
    "nothing",
    "plain retuning",
    "gradient boosting",
    "neural network",
    "SINDy on acceleration",
    "SINDy, integral form",
    "SINDy on responses",
)
SHOWN = 4  # names that a cell holds
HEAD = """\
# Beside other ways

<!-- Rendered by `python -m benchmarks.rivals` from benchmarks/results/rivals.json; do not edit. -->

A model that a recording contradicts can be retuned, corrected by sparse regression, or covered by a
black box. Here each is given the same two training recordings and the same machine file, and is
scored on the same held-out recording: rms of x and y, a constant offset of each channel left out.
A way is right about the cause if it names the planted effect and nothing else.
"""
FOOT = """\
## How each was done

- Plain retuning: the nominal parameters refitted by this engine, priors and all. Every other way
  starts from it and sees what it leaves.
- Black boxes: scikit-learn's histogram gradient boosting, and a network of two layers. Features:
  the retuned model's place, speed and acceleration, the motors' rates now and up to 0.2 s before,
  and for how long each motor has gone its way. They have no cause to name.
- SINDy on acceleration: discrepancy modelling as published (Kaheman et al. 2019). The measured
  position is smoothed and differentiated (its distance from the model's is, which has less to
  smooth away); what the 4-DoF model's acceleration lacks there is regressed by pysindy on 47
  candidates: the laws of this catalogue that are forces on an axis, those with an unknown inside at
  several values (play at three gaps, ringing at four frequencies).
- SINDy, integral form: the same candidates, but what each does to the response is regressed on what
  the response lacks, so that nothing is differentiated.
- SINDy on responses: the candidates are what this project's kernel says that a small effect adds to
  x and y, for all effects and places, up to eight starts of each. A user of pysindy has no such
  library; it shows what the regression is worth once it is given one.
- Sparse regression is pysindy's FROLS (1, 2 or 4 terms) or STLSQ (threshold 0.4 or 0.1 on columns
  of unit rms), or no term at all; a candidate that those before it span is left out, which FROLS
  demands. The nominal model's own terms (masses, stiffness, friction; on responses every nominal
  parameter) are refitted beside, without a threshold. The setting, window included, is the one of
  least Bayesian information criterion on the training recordings (Mangan et al. 2017). Choosing by
  predicting one training recording from the other was tried first and did worse on 1_concealed (no
  term, or on responses a wrong name at 30.06 um), so that the rivals have the better of the two.
- The black boxes' sizes, "nothing" among them, are those that predict one training recording best
  from the other. No way sees the held-out recording.
- Where a channel has more than 3000 samples, every n-th is learned from, by all but this engine.
- A correction of a sparse law is simulated (4-DoF) and put on top of the full model's response; one
  that runs away is shown as such.
- This engine's line on a mechanism case is that of its sealed run (`benchmarks.mechanism.proof`).

What the table does not say: whether somebody who knows those tools better would get more out of
them, nor how they do on machines of other kinds. A few cases are examples, not rates; rates of
this engine are in [RESULTS.md](../RESULTS.md). Where a case has no line of this engine, its
diagnosis was not run for this table (`corexy demo` runs it on the bundled examples).
"""


def microns(value: float | None) -> str:
    """An rms, or that there is none."""
    if value is None:
        return "-"
    return f"{1e6 * value:.2f}" if value < 1e-3 else "runs away"


def cause(names: list[str]) -> str:
    """Names in a cell."""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more or "-"


def verdict(names: list[str], truth: list[str]) -> str:
    """What naming these is worth."""
    if names == truth:
        return "yes" if truth else "rightly none"
    if not names:
        return "names none"
    return "among others" if set(truth) & set(names) else "**wrong**"


def rows(entry: Mapping[str, Any]) -> list[str]:
    """The table of one case."""
    ways = {n: entry["ways"][n] for n in ORDER if n in entry["ways"]}
    if "ours" in entry:
        ways["this engine"] = entry["ours"]
    table = ["| way | held-out rms [um] | names | right | setting |", "|---|---|---|---|---|"]
    for name, way in ways.items():
        said = verdict(way["named"], entry["cause"]) if name not in ORDER[:4] else "cannot name"
        cells = (name, microns(way["rms"]), cause(way["named"]), said, way.get("setting", "-"))
        table.append(f"| {' | '.join(cells)} |")
    return table


def page(results: Mapping[str, Any]) -> str:
    """The whole page."""
    lines = [HEAD]
    for name, entry in sorted(results.items()):
        planted = " + ".join(entry["cause"]) or "nothing"
        lines += [
            f"## {name}: {planted}",
            "",
            f"Noise {microns(entry['noise'])} um, spikes and blanks besides where the drawing put"
            f" them; commit {entry['commit'][:12]}.",
            "",
            *rows(entry),
            "",
        ]
    return "\n".join([*lines, FOOT])
