"""docs/pulses.md: what step pulses do to a stage, and whether the paper's pulse interval holds.

python -m benchmarks.pulses             # runs everything, about half a minute
python -m benchmarks.pulses --render    # only the page and its figures, out of the stored JSON
python -m benchmarks.pulses --check     # fails where the page is not what would be rendered
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.outcome import RESULTS, keep_page, write_outcome
from benchmarks.pulses_page import PAGE, draw, page
from benchmarks.pulses_runs import (
    ROW,
    STEP,
    at_corner,
    by_jumps,
    modal_frequency,
    off_line,
    pulsed_corner,
    resonance_speed,
    ripple,
    settling,
    straight,
)
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.motion import command, line
from corexy_fmi.pulses import Driver, staircase
from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce.claims import CRITERIA
from corexy_fmi.reproduce.measure import SETTLED
from corexy_fmi.reproduce.paper import SETS, SPEEDS, bundled, label
from corexy_fmi.reproduce.paths import full_step
from corexy_fmi.reproduce.result import Cell, Table
from corexy_fmi.reproduce.sets import without_coulomb
from corexy_fmi.simulate import excitation, machine_vector

MICROSTEPS, PRINTER, ASKED = (1, 2, 8, 16), "gt2_printer", 0.020  # [m/s]
SWEPT = np.linspace(2e-3, 60e-3, 233)  # [m/s]
NAMES = {1: "full", 2: "half", 8: "1/8", 16: "1/16"}
WINDOW = (0.9, 0.96)  # [s] of the trace
HELD = np.sqrt(2) * SETTLED  # of a step: one axis 5 % off, seen along the 45-degree line
SIDE = 6  # full steps on each side of a corner
ORDER = ("P1", "P0", "P2")
MILLI, MICRO = 1e3, 1e6


def resonance() -> Table:
    """Where steps meet the modes of the printer, and the ripple there and at 0.020 m/s."""
    machine, rows = bundled(PRINTER), []
    for axis in "xy":
        for n in MICROSTEPS:
            speed = resonance_speed(machine, axis, n)
            swings = [MICRO * ripple(machine, axis, v, n) for v in (speed, ASKED)]
            step = MILLI * full_step(machine.parameters["pulley_radius"]) / n
            rate = ASKED * MILLI / step
            mode = modal_frequency(machine, axis)
            rows.append((axis, NAMES[n], step, mode, MILLI * speed, swings[0], rate, swings[1]))
    head = ("axis", "steps", "step [mm]", "mode [Hz]", "resonance speed [mm/s]",
            "ripple there [um]", "pulses at 20 mm/s [1/s]", "ripple at 20 mm/s [um]")  # fmt: skip
    return Table("Steps and modes of gt2_printer, ripple peak to peak", head, tuple(rows))


def swept() -> dict[str, Any]:
    """Ripple [um] over speed, each axis and microstep."""
    machine = bundled(PRINTER)
    curves = {
        axis: {
            NAMES[n]: [round(MICRO * ripple(machine, axis, float(v), n), 2) for v in SWEPT]
            for n in MICROSTEPS
        }
        for axis in "xy"
    }
    speeds = {axis: resonance_speed(machine, axis, 1) for axis in "xy"}
    return {"speed_mm_s": (MILLI * SWEPT).round(4).tolist(), "ripple_um": curves,
            "resonance_mm_s": {a: round(MILLI * v, 4) for a, v in speeds.items()}}  # fmt: skip


def trace() -> dict[str, Any]:
    """x of the printer less the command [um] at 0.020 m/s, full steps and 1/16."""
    machine, found = bundled(PRINTER), {}
    for n in (1, 16):
        order = straight(machine, "x", ASKED, n)
        near = (order.time > WINDOW[0]) & (order.time < WINDOW[1])
        off = MICRO * off_line(machine, "x", ASKED, order)[near]
        found[NAMES[n]] = {"time_s": order.time[near].round(6).tolist(),
                           "off_um": off.round(2).tolist()}  # fmt: skip
    return found


def interval() -> Table:
    """The pulse-interval claim: a corner with a pulse every settling time, and every second one."""
    rows: list[tuple[Cell, ...]] = []
    for name in ORDER:
        machine = bundled(SETS[name])
        quiet = replace(machine, parameters=without_coulomb(machine.parameters))
        for turn in TURNS:
            for n in MICROSTEPS:
                rows += _claimed(name, machine, quiet, turn, n)
    head = ("set", "turn", "steps", "settling [ms]", "Coulomb friction", "error at 1 x [um]",
            "of a step", "error at 2 x [um]", "of a step, 2 x",
            "overshoot at 1 x, of a step", "held")  # fmt: skip
    return Table("A corner in pulses, one every settling time and one every two", head, tuple(rows))


def _claimed(
    name: str, machine: Machine, quiet: Machine, turn: str, n: int
) -> list[tuple[Cell, ...]]:
    """Without and with dry friction; the settling time is that without."""
    radius = machine.parameters["pulley_radius"]
    wait, step, rows = settling(quiet, turn[0], n), full_step(radius) / n, []
    corners = [pulsed_corner(turn, k * wait, radius, n, SIDE * n) for k in (1, 2)]
    for word, which in (("without", quiet), ("with", machine)):
        (first, over), (second, _) = (at_corner(which, corner) for corner in corners)
        shares = first / step, second / step
        held = max(shares) <= HELD
        rows.append(
            (name, turn, NAMES[n], MILLI * wait, word, MICRO * first, shares[0], MICRO * second,
             shares[1], over / step, "held" if held else "not held")
        )  # fmt: skip
    return rows


def at_speeds() -> Table:
    """P1 at the paper's speeds: its pulses come every 8, 4 and 2 ms."""
    machine, rows = bundled(SETS["P1"]), []
    radius = machine.parameters["pulley_radius"]
    for turn in TURNS:
        for speed in SPEEDS:
            errors = []
            for n in (*MICROSTEPS, 256):
                every = full_step(radius) / n / speed
                count = max(6, int(np.ceil(max(1.5 * speed, 0.03) / (full_step(radius) / n))))
                corner = pulsed_corner(turn, every, radius, n, count)
                errors.append(MICRO * at_corner(machine, corner)[0])
            rows.append((turn, MILLI * speed, MILLI * full_step(radius) / speed, *errors))
    head = ("turn", "speed [mm/s]", "full steps every [ms]", *(f"{w} [um]" for w in NAMES.values()),
            "1/256 [um]")  # fmt: skip
    return Table("P1, contour error, eq. (17), at the paper's speeds", head, tuple(rows))


def accuracy() -> Table:
    """The kernel against an exact solution whose angles jump."""
    layout, rows = bundled_layout(), []
    for name in ORDER:
        machine = bundled(SETS[name])
        vector = machine_vector(machine)[None]
        smooth = command(
            line((0, 0), (4e-3, 0), ASKED), machine.parameters["pulley_radius"], 1 / ROW
        )
        for n in MICROSTEPS:
            made = staircase(smooth, Driver(n))
            exact, drive = by_jumps(machine, made), excitation(machine, made)
            runs = [run_lanes(layout, drive, vector, limit=h)[0].T for h in (0.0, STEP)]
            rows.append((name, NAMES[n], *(float(MICRO * np.abs(r - exact).max()) for r in runs)))
    head = ("set", "steps", "automatic step [um]", "20 us steps [um]")
    return Table("x moved 4 mm at 20 mm/s: kernel less exact solution", head, tuple(rows))


def document() -> dict[str, Any]:
    """All numbers."""
    tables = [resonance(), interval(), at_speeds(), accuracy()]
    return {
        "labels": [label(bundled(SETS[name])) for name in ORDER],
        "criterion": CRITERIA["f"],
        "tables": [{"title": t.title, "rows": t.records()} for t in tables],
        "swept": swept(),
        "trace": trace(),
    }


def main() -> int:
    """Run, render or check; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--render", action="store_true", help="run nothing")
    parser.add_argument("--check", action="store_true", help="write nothing, fail where stale")
    given = parser.parse_args()
    if not (given.render or given.check):
        print(write_outcome("pulses", "python -m benchmarks.pulses", document()))
    stored = json.loads((RESULTS / "pulses.json").read_text(encoding="utf-8"))
    if not given.check:
        draw(stored)
    return keep_page(PAGE, page(stored), "python -m benchmarks.pulses", check=given.check)


if __name__ == "__main__":
    sys.exit(main())
