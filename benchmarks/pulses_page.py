"""docs/pulses.md and its figures, out of benchmarks/results/pulses.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from corexy_fmi.reproduce.result import SVG, shown

ROOT = Path(__file__).parents[1]
PAGE, IMAGES = ROOT / "docs" / "pulses.md", ROOT / "docs" / "images" / "pulses"
COLOURS = {"full": "#d62728", "half": "#ff7f0e", "1/8": "#1f77b4", "1/16": "#2ca02c"}
TEXT = """\
# Step pulses

<!-- Rendered by `python -m benchmarks.pulses` from benchmarks/results/pulses.json; do not edit. -->

A stepper's driver turns no smooth angle: it counts microsteps, and each pulse is a jump.

```
corexy pulses part.gcode --microsteps 1 --centre 0.1,0.1 --machine gt2_printer --out full.csv
corexy simulate full.csv --plant fmu --machine gt2_printer --out response.csv
corexy rectangle --width 0.06 --height 0.04 --speed 0.02 --microsteps 16 --out run.csv
```

`corexy pulses` takes G-code (G0 to G4, G20, G21, G90 to G92, arcs by I and J), or a CSV of phi1,
phi2 or of x, y. A pulse comes when the ideal angle passes the middle between two microsteps, at
that time exactly; in the recording it is two rows 10 ns apart, which kernel, FMU and any other
reader of recordings take as they are. The staircase stays within half a microstep of the ideal
angle and loses none. Motor torques in the row behind a pulse are those of a jump in 10 ns: read
them elsewhere. A program's moves have constant speed, or with `--accel` go from rest to rest each.

{labels}

Measured by `{command}` at commit `{commit}`, micro-steps of 20 us.

## Full steps meet a mode

Along an axis both motors step at once, r 1.8 degree further. Where that happens as often as the
stage swings by itself, at v = f r (1.8 degree) / n for n microsteps, the steps drive the mode. On
gt2_printer that is {x:.2f} mm/s for x: at 20 mm/s full steps come at {rate:.1f} Hz, its mode in x
lies at {mode:.1f} Hz, and x swings by {swing:.2f} mm peak to peak, {times:.0f} times the step. With
1/16 steps {fine}. In y the same happens at {y:.2f} mm/s.

![Ripple of x and y over speed, gt2_printer, full steps to 1/16](images/pulses/resonance.svg)

![x of gt2_printer at 20 mm/s with full and with 1/16 steps](images/pulses/trace.svg)

{resonance}

Ripple is peak to peak about the commanded straight line, after 0.8 s, dry friction included.

## The paper's pulse interval

Claim (f): no contour error beyond 5 % once a pulse takes longer than the settling time. Checked as:
{criterion}. {verdict}

{interval}

At the paper's speeds pulses come far faster than that, and hardly change the corner of P1:

{speeds}

## How exact

The kernel beside a solution that is exact between events and whose angles jump. Full steps excite
modes that smooth motion does not: on P2 (gt2_printer) the automatic step is too long for them.

{accuracy}
"""


def page(stored: Mapping[str, Any]) -> str:
    """The whole page."""
    tables = [t["rows"] for t in stored["tables"]]
    names = ("resonance", "interval", "speeds", "accuracy")
    full, fine = tables[0][0], tables[0][3]
    small = fine["ripple at 20 mm/s [um]"]
    return TEXT.format(
        **{name: table(rows) for name, rows in zip(names, tables, strict=True)},
        labels="\n".join(f"- {text}" for text in stored["labels"]),
        command=stored["command"],
        commit=stored["commit"][:12],
        criterion=stored["criterion"],
        verdict=verdict(tables[1]),
        x=full["resonance speed [mm/s]"],
        y=tables[0][4]["resonance speed [mm/s]"],
        rate=full["pulses at 20 mm/s [1/s]"],
        mode=full["mode [Hz]"],
        swing=full["ripple at 20 mm/s [um]"] / 1e3,
        times=full["ripple at 20 mm/s [um]"] / 1e3 / full["step [mm]"],
        fine=f"it is {small:.2g} um" if small >= 0.05 else "it is below 0.05 um",
    )


def verdict(rows: Sequence[Mapping[str, Any]]) -> str:
    """Where the claim held, in words."""
    parts = []
    for word in ("without", "with"):
        mine = [r for r in rows if r["Coulomb friction"] == word]
        held = [r for r in mine if r["held"] == "held"]
        parts.append(f"{word} Coulomb friction it held in {len(held)} of {len(mine)} cases")
        lost = sorted({f"{r['set']} {r['turn']}" for r in mine if r["held"] != "held"})
        parts[-1] += f" (not: {', '.join(lost)})" if lost else ""
    said = "; ".join(parts)
    return (
        f"**{said[0].upper()}{said[1:]}.** Dry friction leaves an error that does not shrink "
        "with the step: the finer the microstep, the larger its share. P0 and P2 overshoot, so "
        "that eq. (17) reads about zero: where they hold, they hold idly: read the overshoot."
    )


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Markdown of a table."""
    lines = [list(rows[0]), ["---"] * len(rows[0])]
    lines += [[_cell(cell) for cell in row.values()] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(cell: Any) -> str:
    return "0" if isinstance(cell, float) and abs(cell) < 5e-4 else shown(cell)


def draw(stored: Mapping[str, Any]) -> None:
    """Both figures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    with rc_context(SVG):
        _save(_resonance(stored["swept"]), "resonance.svg")
        _save(_trace(stored["trace"]), "trace.svg")


def _resonance(swept: Mapping[str, Any]) -> Figure:
    figure = Figure(figsize=(9, 5.5), layout="constrained")
    for axes, axis in zip(figure.subplots(2, 1, sharex=True), "xy", strict=True):
        for name, curve in swept["ripple_um"][axis].items():
            shown_curve = [max(value, 0.05) for value in curve]
            look = {"color": COLOURS[name], "label": f"{name} steps", "linewidth": 1.0}
            axes.semilogy(swept["speed_mm_s"], shown_curve, **look)
        axes.axvline(swept["resonance_mm_s"][axis], color="#444444", linewidth=0.6, linestyle="--")
        axes.set(ylabel=f"ripple of {axis} [um]")
    axes.set(xlabel="speed [mm/s]   (dashed: full steps at the modal frequency)")
    figure.axes[0].legend(loc="upper right", ncols=4)
    figure.axes[0].set_title(
        "gt2_printer (P2, not the paper's machine): ripple peak to peak", fontsize=9
    )
    return figure


def _trace(trace: Mapping[str, Any]) -> Figure:
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    axes = figure.subplots()
    for name, curve in trace.items():
        axes.plot(curve["time_s"], curve["off_um"], color=COLOURS[name], label=f"{name} steps")
    axes.set(xlabel="time [s]", ylabel="x less its command [um]")
    axes.set_title("gt2_printer (P2) along x at 20 mm/s", fontsize=9)
    axes.legend(loc="upper right")
    return figure


def _save(figure: Figure, name: str) -> None:
    figure.savefig(IMAGES / name, metadata={"Date": None})
