"""What may be missing: every catalogued effect at every place, and free-form laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.free_form import LawShape
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.machine import Machine
from corexy_fmi.machine.laws import AXES
from corexy_fmi.topologies import knows

SPEED_KNOTS = (-1.0, -0.4, -0.14, -0.05, -0.015, 0.015, 0.05, 0.14, 0.4, 1.0)  # peaks are narrow
PLACE_KNOTS, TIME_KNOTS = 9, 12


def instances(
    layout: Layout, machine: Machine, without: frozenset[str] = frozenset()
) -> list[Instance]:
    """The (effect, location) pairs that this machine can have and does not have yet.

    ``without`` names effects that are struck from the catalogue (a control of the proof).
    """
    present = {(e.name, e.location) for e in machine.effects}
    return [
        i
        for i in layout.instances
        if machine.drive in i.effect.drives
        and knows(machine.stage, i.effect, i.location)
        and i.effect.name not in without
        and (i.effect.name, i.location) not in present
    ]


def _knots(argument: str, values: Array) -> tuple[float, ...]:
    low, high = float(values.min()), float(values.max())
    if argument in ("vx", "vy"):
        top = float(np.quantile(np.abs(values), 0.99)) or 1.0
        return tuple(top * k for k in SPEED_KNOTS)
    count = TIME_KNOTS if argument == "t" else PLACE_KNOTS
    return tuple(np.linspace(low, high if high > low else low + 1.0, count))


def laws(problem: Problem, u: Array) -> list[LawShape]:
    """Free-form laws of every driven coordinate over every argument, knots over the runs' range."""
    machine = problem.machine
    if machine.fidelity == "kinematic":
        return []
    names = ("vx", "vy", "x_true", "y_true", "phi1", "phi2")
    out = [problem.simulate(u[None], r, names)[0] for r in range(len(problem.runs))]
    ranges = dict(zip(names, np.concatenate(out, axis=1), strict=True))
    ranges["t"] = np.concatenate([r.excitation.time for r in problem.runs])
    force = max(machine.at("carriage_coulomb_friction"), 0.05)
    torque = force * machine.parameters["pulley_radius"]
    places = {"x": force, "y": force} | (
        {"motor1": torque, "motor2": torque} if machine.drive == "dc" else {}
    )
    taken = {law.location for law in machine.free_forms}  # a coordinate holds one law
    places = {
        n: scale for n, scale in places.items() if n in machine.kind.forces and n not in taken
    }
    known = {
        name.removesuffix("_true"): _knots(name, values)
        for name, values in ranges.items()
        if name.removesuffix("_true") in machine.kind.arguments
    }
    forces = [LawShape(p, a, k, scale) for p, scale in places.items() for a, k in known.items()]
    frictions = [
        LawShape(place, argument, known[argument], places[place], acts="friction")
        for place in places
        if place in AXES
        for argument in (place, "t")
    ]
    return forces + frictions


def finer(law: LawShape) -> LawShape:
    """The same law with a knot more between any two."""
    knots = np.array(law.knots)
    return replace(law, knots=tuple(np.sort(np.r_[knots, (knots[1:] + knots[:-1]) / 2])))


def hypotheses(
    problem: Problem, u: Array, without: frozenset[str] = frozenset()
) -> list[Hypothesis]:
    """All single hypotheses."""
    single = [Hypothesis((i,)) for i in instances(problem.layout, problem.machine, without)]
    return single + [Hypothesis(law=law) for law in laws(problem, u)]
