"""What a sensor that misreads, a tool, a frame or a bridge that turns would add to x and y."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.fit import Fit
from corexy_fmi.engine.probe_laws import Motion
from corexy_fmi.kernel.call import Array
from corexy_fmi.topology import STAGES

MODES = tuple(np.geomspace(3.0, 100.0, 12))  # [Hz] of what swings on the stage, or under it
DAMPED = 0.05  # its damping ratio
BENT = {"x": "x", "y": "y", "x squared": "xx", "x times y": "xy", "y squared": "yy"}  # factors
Added = tuple[str, str, str, list[dict[str, Array]]]  # location, state, word, by channel


def outputs(fit: Fit, runs: list[Motion]) -> list[Added]:
    """All that may be added to the outputs of the runs, place by place."""
    return [*_sensor(runs), *_swinging(fit, runs), *_turning(fit, runs)]


def _sensor(runs: list[Motion]) -> Iterator[Added]:
    """What a sensor may misread, each of its axes for itself, or both late alike."""
    for axis in ("x", "y"):
        for word, powers in BENT.items():
            yield (
                "sensor",
                "position",
                f"{axis} off by {word}",
                [{axis: np.prod([m.place[w] for w in powers], axis=0)} for m in runs],
            )
        yield "sensor", "speed", f"{axis} late", [{axis: m.speed[axis]} for m in runs]
        yield (
            "sensor",
            "time",
            f"{axis} ever later",
            [{axis: (m.time - m.time[0]) * m.speed[axis]} for m in runs],
        )
    yield "sensor", "speed", "both late", [{a: m.speed[a] for a in "xy"} for m in runs]
    yield (
        "sensor",
        "time",
        "both ever later",
        [{a: (m.time - m.time[0]) * m.speed[a] for a in "xy"} for m in runs],
    )


def swing(values: Array, time: Array, frequency: float) -> Array:
    """Where a mass on a damped spring comes to under these accelerations (rows,)."""
    dt, w = float(np.median(np.diff(time))), 2 * np.pi * frequency
    decay, turn = np.exp(-DAMPED * w * dt), np.cos(w * np.sqrt(1 - DAMPED**2) * dt)
    poles = [1.0, -2 * decay * turn, decay**2]
    return np.asarray(lfilter([0.0, sum(poles) / w**2], poles, values))


def _swinging(fit: Fit, runs: list[Motion]) -> Iterator[Added]:
    """A tool that lags behind the accelerations of both axes, or a frame that their forces move."""
    values = fit.problem.machine.parameters
    carriage = values["carriage_mass"]
    masses = {"x": carriage, "y": carriage + values["bridge_mass"] + 4 * values["pulley_mass"]}
    accelerations = [{a: np.gradient(m.speed[a], m.time) for a in "xy"} for m in runs]
    times = [m.time for m in runs]
    for location, weights in (("tool", dict.fromkeys("xy", 1.0)), ("frame", masses)):
        for f in MODES:
            bent = [
                {axis: weights[axis] * swing(values, t, f) for axis, values in pair.items()}
                for pair, t in zip(accelerations, times, strict=True)
            ]
            late = [
                {axis: np.gradient(values, t) for axis, values in pair.items()}
                for pair, t in zip(bent, times, strict=True)
            ]
            yield location, "acceleration", f"a mode near {f:.0f} Hz", bent
            yield location, "acceleration", f"a mode near {f:.0f} Hz, damped", late


def _turning(fit: Fit, runs: list[Motion]) -> Iterator[Added]:
    """A bridge that the belts turn: y by x times the turn."""
    stage = STAGES[fit.problem.machine.stage]
    arms = np.array([s.yaw_arm for s in stage.sections], dtype=float)
    names = tuple(f"tension{n + 1}" for n in np.flatnonzero(arms))
    if not names:
        return
    pulls = [
        arms[arms != 0] @ fit.problem.simulate(fit.u[None], r, names)[0] for r in range(len(runs))
    ]
    for f in (*MODES, 1e3):
        word = "its turn" if f == MODES[-1] else f"a mode near {f:.0f} Hz"
        yield (
            "bridge",
            "position",
            word,
            [
                {
                    "y": m.place["x"]
                    * swing(p, m.time, min(f, 0.1 / float(np.median(np.diff(m.time)))))
                }
                for m, p in zip(runs, pulls, strict=True)
            ],
        )
