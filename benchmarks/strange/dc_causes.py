"""Causes in dc drives, and all that are drawn for them.  A docstring has the unit of a size.

No steps are missed; run-out and play act on a rotor that gives way (`loop.py`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.strange.cause import About, Cause, Draws, Parameters, pair
from benchmarks.strange.drive_causes import DRIVES, SENSORS
from benchmarks.strange.load_causes import LOADS
from benchmarks.strange.loop import Drive
from benchmarks.strange.machines import Random
from benchmarks.strange.running import HEALTHY, Acts, looped

DAMPS = 0.4  # of the lag at which a rigid stage's loop were undamped, at most


def _driven(
    name: str,
    bounds: tuple[float, float],
    told: Callable[[float], Parameters],
    drive: Callable[[float], Drive],
    location: str = "motors",
) -> Cause:
    """A cause in both drives, or at a motor."""
    return Cause(name, location, bounds, told, lambda size: Acts(drive=drive(size)))


def _supply_saturation(random: Random, about: About) -> Cause:
    """A healthy stage's highest voltage in the recordings to fit over the limit, less one [1]."""
    runs = [looped(about.machine, n, about.motions[n], HEALTHY) for n in range(2)]
    highest = float(max(np.abs(ran.volts).max() for ran in runs))
    return _driven("supply_saturation", (1e-3, 4.0), lambda s: {"voltage": highest / (1 + s)},
                   lambda s: Drive(limit=highest / (1 + s)))  # fmt: skip


def _driver_deadband(random: Random, about: About) -> Cause:
    """Half of the band [V], of which larger voltages lose all or a share."""
    lost = float(random.choice([1.0, random.uniform(0.0, 1.0)]))
    return _driven("driver_deadband", (1e-3, 5.0), lambda s: {"voltage": s, "lost": lost},
                   lambda s: Drive(dead=s, lost=lost))  # fmt: skip


def _winding_lag(random: Random, about: About) -> Cause:
    """L/R of both windings [s]; the loop stays damped."""
    n = about.machine.numbers
    longest = min(DAMPS * (n["kd"] + n["K2"] / n["K1"]) / n["kp"], 0.05)
    return _driven("winding_lag", (1e-4, longest), lambda s: {"time_constant": s},
                   lambda s: Drive(lag=s))  # fmt: skip


def _torque_ripple(random: Random, about: About) -> Cause:
    """Ripple over torque [1], with 5 to 19 a turn, of current and back-EMF alike."""
    order, phase = float(random.integers(5, 20)), float(random.uniform(-np.pi, np.pi))
    told = {"order": order, "phase": phase, "back_emf": 1.0}
    return _driven("torque_ripple", (2e-3, 0.6), lambda s: {"ratio": s, **told},
                   lambda s: Drive(ripple=s, order=order, phase=phase))  # fmt: skip


def _pulley_eccentricity(random: Random, about: About) -> Cause:
    """Half of the run-out of a motor's pulley, peak to peak [m]."""
    motor, phase = int(random.integers(2)), float(random.uniform(-np.pi, np.pi))
    radius, turned = about.machine.numbers["r"], pair(motor, phase, 0.0)

    def drive(size: float) -> Drive:
        return Drive(runout=pair(motor, size / radius, 0.0), turned=turned)

    return _driven("pulley_eccentricity", (2e-6, 1e-3), lambda s: {"amplitude": s, "phase": phase},
                   drive, f"motor{motor + 1}")  # fmt: skip


BELTS = DRIVES[:2]  # backlash, belt_mismatch
DC_DRIVES: tuple[Draws, ...] = (
    *BELTS, _pulley_eccentricity, _supply_saturation, _driver_deadband, _winding_lag,
    _torque_ripple,
)  # fmt: skip
DC_KINDS: tuple[tuple[Draws, ...], ...] = (LOADS, DC_DRIVES, SENSORS)
DC_CAUSES: tuple[Draws, ...] = LOADS + DC_DRIVES + SENSORS
