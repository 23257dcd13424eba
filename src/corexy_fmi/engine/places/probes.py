"""Probes: what a small unknown law at some place would do, one simple function of the motion each.

A motor's angle may be off by a function of that angle, its direction, its speed or of time; an
axis may feel a force, or both that of a frame that swings; a belt may stretch by more than its load
says.  Forces and stretches act here
as the motor angles that would move the end-effector as far at rest: belts pull on nothing else
(eqs (6), (15) of Yin et al. 2018).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.naming.tones import tones
from corexy_fmi.engine.places.probe_laws import (
    Function,
    Motion,
    of_axis,
    of_belt,
    of_idler,
    of_motor,
    of_voltage,
)
from corexy_fmi.engine.places.swings import swung
from corexy_fmi.kernel.call import Array

NAMES = ("x_true", "y_true", "vx", "vy", "phi1", "phi2", "V1", "V2")
FIRST, SECOND = (1.0, 0.0), (0.0, 1.0)  # how the motors turn for one of them, for an axis
ALIKE, APART = (1.0, 1.0), (1.0, -1.0)


@dataclass(frozen=True, eq=False)
class Probe:
    """A function of the motion at a place: its state (CONTRACT 4), a word for it, and how far it
    moves motor 1 and 2, or in ``volts`` what it adds to their voltages, (rows,) for each run and
    motor, on any scale.
    """

    location: str
    state: str
    word: str
    turns: tuple[tuple[Array, Array], ...]
    volts: bool = False


def motions(fit: Fit) -> list[Motion]:
    """The motion of every run of a fit."""
    radius, found = fit.problem.machine.parameters["pulley_radius"], []
    for r, run in enumerate(fit.problem.runs):
        out = dict(zip(NAMES, fit.problem.simulate(fit.u[None], r, NAMES)[0], strict=True))
        time = run.excitation.time
        place = {"x": out["x_true"], "y": out["y_true"]}
        place |= {f"motor{n}": out[f"phi{n}"] for n in (1, 2)}
        speed = {"x": out["vx"], "y": out["vy"]}
        speed |= {f"motor{n}": np.gradient(out[f"phi{n}"], time) for n in (1, 2)}
        both = (place["x"] + place["y"], place["x"] - place["y"])
        stretch = tuple(b - radius * place[f"motor{n}"] for n, b in enumerate(both, 1))
        voltage = {f"motor{n}": out[f"V{n}"] for n in (1, 2)}
        found.append(Motion(time, place, speed, (stretch[0], stretch[1]), voltage))
    return found


def probes(fit: Fit, runs: list[Motion]) -> Iterator[list[Probe]]:
    """Probes of motors, of belts and idlers, of axes and the frame, a kind at a time."""
    radius, dc = fit.problem.machine.parameters["pulley_radius"], fit.problem.machine.drive == "dc"
    yield [
        probe
        for name, ways in (("motor1", FIRST), ("motor2", SECOND))
        for probe in (
            *_moving(name, of_motor(runs, name), ways),
            *(_moving(name, of_voltage(runs, name), ways, True) if dc else ()),
        )
    ]
    yield [
        probe
        for n, ways in enumerate((FIRST, SECOND))
        for probe in (
            *_moving(f"belt{n + 1}", of_belt(runs, n), ways),
            *_moving(f"pulley{n + 3}", of_idler(runs, radius), ways),
        )
    ]
    heard = tones(fit)
    yield [
        probe
        for name, ways in (("x", ALIKE), ("y", APART))
        for probe in _moving(name, of_axis(runs, name, heard), ways)
    ]
    yield [*_on_both_axes(fit, runs)]


def _on_both_axes(fit: Fit, runs: list[Motion]) -> Iterator[Probe]:
    """The forces on both axes of a frame that swings under those that accelerate them."""
    values = fit.problem.machine.parameters
    carriage = values["carriage_mass"]
    bridge = carriage + values["bridge_mass"] + 4 * values["pulley_mass"]
    for word, swings in swung(runs):
        pulls = [(carriage * swing["x"], bridge * swing["y"]) for swing in swings]
        turns = tuple((x + y, x - y) for x, y in pulls)
        yield Probe("frame", "acceleration", word, turns)


def _moving(
    location: str, functions: Iterator[Function], ways: tuple[float, float], volts: bool = False
) -> list[Probe]:
    """Probes that move the motors these ways."""
    return [
        Probe(location, state, word, tuple((ways[0] * v, ways[1] * v) for v in values), volts)
        for state, word, values in functions
    ]
