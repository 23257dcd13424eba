"""What a sensor that misreads, a tool or a bridge that turns would add to x and y."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.naming.modes import swing
from corexy_fmi.engine.places.probe_laws import Motion
from corexy_fmi.engine.places.swings import DAMPED, MODES, swung
from corexy_fmi.kernel.call import Array
from corexy_fmi.topology import STAGES

BENT = {"x": "x", "y": "y", "x squared": "xx", "x times y": "xy", "y squared": "yy"}  # factors
Added = tuple[str, str, str, list[dict[str, Array]]]  # location, state, word, by channel


def outputs(fit: Fit, runs: list[Motion]) -> list[Added]:
    """All that may be added to the outputs of the runs, place by place."""
    tool = [("tool", "acceleration", word, added) for word, added in swung(runs)]
    return [*_sensor(runs), *tool, *_turning(fit, runs)]


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
                    * swing(p, m.time, min(f, 0.1 / float(np.median(np.diff(m.time)))), DAMPED)
                }
                for m, p in zip(runs, pulls, strict=True)
            ],
        )
