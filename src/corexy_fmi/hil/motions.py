"""What a run is made of: the way to its start, a rest, and the motion itself."""

from __future__ import annotations

import numpy as np

from corexy_fmi.hil.limits import Scale
from corexy_fmi.hil.segments import Plan, plan
from corexy_fmi.motion import chain, command, line, rest
from corexy_fmi.recording import Recording, inputs

APPROACH_SPEED, APPROACH_ACCELERATION = 0.02, 0.2  # [m/s, m/s^2]
SETTLE = 0.5  # [s] of rest before the motion


def with_approach(order: Recording, scale: Scale, counts: tuple[int, int]) -> tuple[Plan, float]:
    """The plan from where the board stands along a command, and when its command begins [s]."""
    given = inputs(order)
    angles = np.column_stack([given["phi1"], given["phi2"]])
    first = scale.point(float(angles[0, 0]), float(angles[0, 1]))
    way = chain(
        rest(scale.place(counts), 0.01),
        line(scale.place(counts), first, APPROACH_SPEED, APPROACH_ACCELERATION),
        rest(first, SETTLE),
    )
    before = command(way, scale.radius)
    way_angles = np.column_stack([before["phi1"], before["phi2"]])
    begin = float(np.rint(before.time[-1] / scale.tick)) * scale.tick
    time = np.concatenate([before.time[:-1], begin + order.time - order.time[0]])
    return plan(time, np.concatenate([way_angles[:-1], angles]), scale, counts), begin
