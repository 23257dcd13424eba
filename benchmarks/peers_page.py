"""docs/speed.md and its figures, out of benchmarks/results/peers.json."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers_figures import draw as draw
from benchmarks.peers_verdicts import ALLOWED as ALLOWED
from benchmarks.peers_verdicts import selected as selected
from benchmarks.peers_verdicts import times_of, verdicts
from corexy_fmi.kernel.call import LANES
from corexy_fmi.reproduce.result import shown

PAGE = Path(__file__).parents[1] / "docs" / "speed.md"
QUIET = 0.5  # load average per core beside the measuring process
Row = Mapping[str, Any]
TEXT = """\
# Speed

<!-- Rendered by `python -m benchmarks.peers` from benchmarks/results/peers.json; do not edit. -->

The same full model (12 coordinates, 12 belt sections, dry friction everywhere) and the same run in
other simulators: {run}.
Each stands with its largest error in x and y against a solution that is exact between stick and
slip events (`benchmarks/exact_stage.py`, derived from Lagrange's equations, no code of the kernel).
A simulator that can trade accuracy for time is shown at the cheapest setting that stays within
{allowed:g} um; where none does, at its most accurate one, in brackets.

`{command}` at commit `{commit}`, one process, {cpu}, {cores} cores;
{versions}.{absent}
{load}

## In short

{verdicts}

{machines}
![Error over time for a run, all settings](images/speed/peers.svg)

## A batch of parameter sets

{batch}

## How near the core's peak

{peak}

## What cost grows with

![Time over parameter sets, simulated time, effects switched on](images/speed/costs.svg)

{costs}

## What was compared

- This kernel: `corexy_fmi.kernel.call.run_lanes` at its automatic step, from Python, with the rows.
- numba: the same scheme, once as loops over a matrix, as one would type it, once with each section
  and coordinate written out by a program, in travels instead of angles; fastmath in both.
- CasADi: the same step as a symbolic function, folded over a row, accumulated over the rows;
  generated C, `-O3 -march=native -ffast-math`; and its interface to CVODES on friction smoothed as
  for SciPy, with exact Jacobians.
- MuJoCo: ten slides with dry friction as `frictionloss`, twelve springs as fixed tendons, the
  motors' pull as applied force, one `mujoco.rollout` in C for the run; friction with
  `solreffriction` so stiff that it stops within a step (its default creeps, tens of um off), and
  `solimpfriction` as hard as it goes.
- SciPy: f tanh(v / width), the width made small, restarted at corners; right-hand side in NumPy.
- Times are the least of several runs, without compiling and building; those are in the JSON.
"""


def page(stored: Mapping[str, Any]) -> str:
    """The whole page."""
    missing = ", ".join(stored["absent"])
    return TEXT.format(
        run=stored["run"],
        allowed=ALLOWED,
        command=stored["command"],
        commit=stored["commit"][:12] + ("+" if stored["commit"].endswith("+") else ""),
        cpu=stored["cpu"],
        cores=stored["cores"],
        versions=", ".join(f"{k} {v}" for k, v in stored["versions"].items()),
        absent=f" Absent: {missing}." if missing else "",
        load=load(stored),
        verdicts="\n".join(f"- {line}" for line in verdicts(stored)),
        machines="\n".join(map(one_machine, stored["machines"])),
        batch=batch(stored["batch"]),
        peak=peak(stored["costs"]["share_of_peak"]),
        costs=costs(stored["costs"]),
    )


def load(stored: Mapping[str, Any]) -> str:
    """What else the machine did."""
    low, high = min(stored["load_average"]), max(stored["load_average"])
    busy = high > 1 + QUIET * stored["cores"]
    said = f"Load average while it ran: {low:g} to {high:g} on {stored['cores']} cores"
    if not busy:
        return f"{said}; of that, this run is about 1."
    return (
        f"{said}: **the machine was busy with other work. Times are too long and ratios are loose; "
        "what two cores give over one says nothing.**"
    )


def one_machine(one: Mapping[str, Any]) -> str:
    """The table of a machine."""
    named = f" ({one['surrogate']})" if one["surrogate"] else ""
    lines = [f"## {one['machine']}{named}", "",
             f"{one['seconds']:g} s, {one['micro_steps']} micro-steps at the automatic step.", "",
             "| simulator | setting | error [um] | one run [ms] | times real time | slower by |",
             "| --- | --- | --- | --- | --- | --- |"]  # fmt: skip
    ratios = times_of(one)
    for row in sorted(selected(one["points"]), key=lambda r: r["seconds"]):
        error = f"{row['error_um']:.3g}"
        cells = [row["peer"], row["setting"], error if row["error_um"] <= ALLOWED else f"({error})",
                 f"{1e3 * row['seconds']:.4g}", f"{one['seconds'] / row['seconds']:.3g}",
                 f"{ratios[row['peer']]:.3g}"]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def batch(b: Mapping[str, Any]) -> str:
    """Throughput with many sets."""
    names = {
        "kernel": "this kernel, eight lanes, 1 process",
        "kernel_processes": f"this kernel, eight lanes, {b['cores']} processes",
        "numba": "numba, written out, 1 thread",
        "numba_threads": f"numba, written out, {b['cores']} threads",
    }
    lines = [
        "| who | us a set | sets a second | times numba on 1 thread |",
        "| --- | --- | --- | --- |",
    ]
    for key, name in names.items():
        if key in b:
            ratio = f"{b['numba'] / b[key]:.2f}" if "numba" in b else "-"
            lines.append(f"| {name} | {1e6 * b[key]:.1f} | {1 / b[key]:,.0f} | {ratio} |")
    told = f"{b['sets']} sets of {b['machine']}, three numbers varied, paths kept in memory."
    if "largest_difference_um" in b:
        told += f" Both give the same paths to {b['largest_difference_um']:.1g} um."
    return "\n".join([told, "", *lines])


def peak(p: Mapping[str, float]) -> str:
    """Floating-point operations a second against the core's."""
    return (
        f"A micro-step of the full model takes {p['sums_and_products']} sums and products (counted "
        f"in the generated C) and {p['least_size_sign']} minima, sizes and signs that count for "
        f"nothing here. Eight lanes take {p['ns_per_lane_step']:.2f} ns a lane and step: "
        f"{p['gflops']:.1f} Gflop/s. A loop of fused products and sums reaches "
        f"{p['peak_fused_gflops']:.0f} Gflop/s on this core, one of products and sums apart "
        f"{p['peak_unfused_gflops']:.0f}: the kernel is at {p['of_fused']:.0%} of the first and "
        f"{p['of_unfused']:.0%} of the second. It is compiled "
        "without fusing, so that every platform gives the same bits; the scheme has more sums than "
        "products, which no fusing pairs."
    )


def costs(c: Mapping[str, Any]) -> str:
    """Lengths, effects off, in words and a table."""
    lines = ["Effects that are off, against a kernel that has none compiled in "
             f"({c['machine']}; ratio of the time a step takes):", "",
             "| lanes | all 35 off | a second copy without: the clock's noise | a call more [us] |",
             "| --- | --- | --- | --- |"]  # fmt: skip
    for name, row in c["off_effects"].items():
        cells = [name.replace("_", " "), f"{row['off_over_absent']:.3f}",
                 f"{row['against_itself']:.3f}", f"{row['more_a_call_us']:.1f}"]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    for key, what in (
        ("over_sets", "parameter sets (from 8 on)"),
        ("over_length", "simulated time"),
    ):
        lines += ["", f"Time over {what}: a straight line within {straight(c[key]):.0%}."]
    on = c["over_effects"]
    lines += ["", "Effects that are on, in the catalogue's order, at steps of 0.1 ms:", "",
              "| effects on | one lane [ns a step] | one of eight lanes [ns a step] |",
              "| --- | --- | --- |"]  # fmt: skip
    lines += [
        f"| {n} | {shown(r['one_lane'])} | {shown(r['of_eight_lanes'])} |" for n, r in on.items()
    ]
    return "\n".join(lines)


def straight(values: Mapping[str, float]) -> float:
    """Largest distance of times from a + b n, as a share of them; 8 lanes are the least."""
    rows = [(float(n), t) for n, t in values.items()]
    rows = [(n, t) for n, t in rows if n >= LANES] if len(rows) > 4 else rows
    n, t = np.array(rows).T
    weights = np.column_stack([np.ones(len(n)), n]) / t[:, None]
    fitted, *_ = np.linalg.lstsq(weights, np.ones(len(n)), rcond=None)
    return float(np.abs(weights @ fitted - 1).max())
