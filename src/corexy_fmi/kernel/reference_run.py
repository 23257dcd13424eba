"""A run of the plain Python stage: what begins it, what drives it, what it shows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from corexy_fmi.kernel.call import PUSH, REST, Excitation
from corexy_fmi.kernel.clock import restamp
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.kernel.reference import ReferenceStage
from corexy_fmi.kernel.reference_state import Array

NO_REST, NO_PUSH = np.zeros(len(REST)), np.zeros(len(PUSH))


def _slope(e: Excitation, row: int) -> Array:
    """Rates (2,) of the inputs on the interval that starts at a row."""
    if row + 1 == len(e.time):
        return np.zeros(2)
    rise = np.array([u[row + 1] - u[row] for u in (e.input1, e.input2)])
    return np.asarray(rise / (e.time[row + 1] - e.time[row]))


def _drive(stage: ReferenceStage, e: Excitation, row: int, ahead: float = 0.0) -> None:
    """Hand a row's inputs to the stage, until the next row; or what they were ``ahead`` [s] of it,
    as its interval goes on backwards.
    """
    slope = _slope(e, row)
    given = np.array([e.input1[row], e.input2[row]]) - slope * ahead
    if e.mode == "angles":
        stage.ramp, stage.ramp_time = (given, slope), float(e.time[row]) - ahead
    elif e.mode == "voltages":
        stage.a["voltage"] = given.copy()
    else:
        error = given - stage.a["q"][2:4]
        rate = e.rate_weight * slope - stage.a["v"][2:4]
        stage.a["voltage"] = e.kp * error + e.kd * rate


def _begin(stage: ReferenceStage, e: Excitation, rest: Array, push: Array, limit: float) -> None:
    """At rest, or after a lead-in off its course."""
    leads = e.lead > 0 and len(e.time) > 1 and e.mode != "voltages"
    ahead, rates, first = e.lead if leads else 0.0, _slope(e, 0), float(e.time[0])
    angles = np.array(e.start()) - ahead * rates
    stage.begin(first - ahead, (float(angles[0]), float(angles[1])), rest)
    if not leads:
        return
    stage.set_off(rates)
    looped = e.mode == "closed_loop"
    rows = int(ahead / (e.time[1] - e.time[0]) + 0.5) if looped else 1
    for n in range(rows):
        _drive(stage, e, 0, ahead * (rows - n) / rows)
        stage.advance(ahead / rows, limit)
    stage.time = stage.begun = first
    stage.push(push)


def run_reference(
    layout: Layout,
    excitation: Excitation,
    vector: Array,
    *,
    fidelity: str = "full",
    dc: bool = False,
    rest: Array = NO_REST,
    push: Array = NO_PUSH,
    limit: float,
    channels: tuple[str, ...] = ("x", "y"),
) -> Mapping[str, Array]:
    """One parameter set through one excitation; ``limit`` is the longest micro-step [s]."""
    stage, time, rows = ReferenceStage(layout, vector, fidelity, dc), excitation.time, []
    _begin(stage, excitation, rest, push, limit)
    for n in range(len(time)):
        _drive(stage, excitation, n)
        rows.append(stage.outputs())
        if n + 1 < len(time):
            stage.advance(float(time[n + 1] - time[n]), limit)
            stage.time = float(time[n + 1])
    found = np.array([[row[c] for row in rows] for c in channels])
    restamp(layout, vector[None], time, channels, found[None])
    return dict(zip(channels, found, strict=True))
