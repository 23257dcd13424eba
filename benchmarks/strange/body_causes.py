"""Causes in guides and in bodies that give way.  A docstring has the unit of a size."""

from __future__ import annotations

import numpy as np

from benchmarks.strange.beside import Beside, Body
from benchmarks.strange.cause import About, Cause, pair
from benchmarks.strange.machines import Random, spread
from benchmarks.strange.running import Acts

STIFF, SOFT = 400.0, 6.0  # [Hz] of a tool or a yaw on its own
SHAKES, FRAMES = (4.0, 60.0), (0.02, 0.1)  # frequency [Hz] and damping ratio of a frame
SOFTEST = 10.0  # [N m/rad] of the guides of a bridge against its yaw
DAMPED = (0.01, 0.1)  # damping ratio of a tool, a yaw


def _guided(random: Random) -> tuple[str, tuple[float, float]]:
    """x, y or both, and a factor for each."""
    which = int(random.integers(3))
    return ("x", "y", "xy")[which], (1.0, 1.0) if which == 2 else pair(which, 1.0, 0.0)


def _load_friction(random: Random, about: About) -> Cause:
    """Dry friction more per pull of the belts across a guide [1]."""
    place, on = _guided(random)
    return Cause("load_friction", place, (2e-3, 0.5), lambda s: {"coefficient": s},
                 lambda s: Acts(beside=Beside(loaded=(s * on[0], s * on[1]))))  # fmt: skip


def _presliding_hysteresis(random: Random, about: About) -> Cause:
    """Dry friction of the guide, of two the less, over the stiffness of bristles [m]."""
    (place, on), n = _guided(random), about.machine.numbers
    friction = min(f for f, o in zip((n["fx"], n["fy"]), on, strict=True) if o)

    def acts(size: float) -> Acts:
        stiffness = friction / size
        return Acts(beside=Beside(bristles=(stiffness * on[0], stiffness * on[1])))

    return Cause("presliding_hysteresis", place, (1e-6, 2e-3),
                 lambda s: {"stiffness": friction / s}, acts)  # fmt: skip


def _soft(size: float) -> float:
    """Frequency [Hz] of a body that gives way by this per acceleration [s^2]."""
    return float(1 / (2 * np.pi * np.sqrt(size)))


GIVES = ((2 * np.pi * STIFF) ** -2, (2 * np.pi * SOFT) ** -2)  # [s^2]


def _racking(random: Random, about: About) -> Cause:
    """Inertia of the bridge's yaw over the stiffness of its guides [s^2]."""
    n = about.machine.numbers
    inertia = (n["my"] / 12 + n["mp"]) * n["W"] ** 2 * random.uniform(0.7, 1.5)
    ratio = spread(random, *DAMPED)
    return Cause("racking", "bridge", (GIVES[0], min(GIVES[1], inertia / SOFTEST)),
                 lambda s: {"stiffness": inertia / s, "inertia": inertia},
                 lambda s: Acts(beside=Beside(yaw=Body(inertia, _soft(s), ratio))))  # fmt: skip


def _frame_mode(random: Random, about: About) -> Cause:
    """What moves along y over the mass of the frame [1]."""
    n = about.machine.numbers
    moves = n["mx"] + n["my"] + 4 * n["mp"]
    hertz, ratio = spread(random, *SHAKES), spread(random, *FRAMES)

    def frame(size: float) -> Body:
        return Body(moves / size, hertz, ratio)

    return Cause("frame_mode", "frame", (5e-3, 1.0),
                 lambda s: {"mass": moves / s, "frequency": hertz, "damping_ratio": ratio},
                 lambda s: Acts(beside=Beside(frame=frame(s))))  # fmt: skip


def _tool_mode(random: Random, about: About) -> Cause:
    """Mass of a tool, a part of the carriage's, over the stiffness that holds it [s^2]."""
    mass = about.machine.numbers["mx"] * spread(random, 0.1, 0.6)
    ratio = spread(random, *DAMPED)
    return Cause("tool_mode", "tool", GIVES,
                 lambda s: {"mass": mass, "frequency": _soft(s), "damping_ratio": ratio},
                 lambda s: Acts(beside=Beside(tool=Body(mass, _soft(s), ratio))))  # fmt: skip


BODIES = (_load_friction, _presliding_hysteresis, _racking, _frame_mode, _tool_mode)
