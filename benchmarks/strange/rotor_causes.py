"""Causes in stepper motors and on their pulleys.  A docstring has the unit of a size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.shop.motions import angles
from benchmarks.strange.belt_causes import pulls
from benchmarks.strange.beside import POLES, Beside, Magnet, Ripple
from benchmarks.strange.cause import About, Cause, pair
from benchmarks.strange.machines import Random, spread
from benchmarks.strange.running import Acts

INERTIA, DAMPED = (2e-6, 3e-5), (0.02, 0.2)  # of a rotor [kg m^2]; its damping ratio
HOLDS, COGGED = (2.5, 10.0), 0.15  # holding torque over the highest load; detent over it, at most
STRONGEST = 5.0  # of a motor's holding torque [N m]
PITCHES = (2e-3, 2.032e-3, 3e-3)  # of teeth [m]


def _load(about: About, inertia: float) -> float:
    """The highest torque [N m] that a healthy stage and its rotors need, were all at once."""
    n, highest = about.machine.numbers, 0.0
    for run, (time, xy) in enumerate(about.motions):
        pull, phi, row = pulls(about, run), angles(xy, n["r"]), float(time[1] - time[0])
        belts = n["r"] * np.abs([pull[:, 1] - pull[:, 2], pull[:, 7] - pull[:, 8]]).max()
        speed, gain = (np.abs(np.diff(phi, k, axis=0)).max() / row**k for k in (1, 2))
        highest = max(highest, float(belts + inertia * gain + n["Bp"] * speed + n["tf"]))
    return highest


def _magnet(holding: float, inertia: float, ratio: float) -> Magnet:
    """A rotor whose damping ratio is that on its own spring."""
    return Magnet(holding, inertia, 2 * ratio * float(np.sqrt(POLES * holding * inertia)))


def _stepper_compliance(random: Random, about: About) -> Cause:
    """The highest load of a healthy stage over the holding torque [1]."""
    inertia, ratio = spread(random, *INERTIA), spread(random, *DAMPED)
    load = _load(about, inertia)

    def magnet(size: float) -> Magnet:
        return _magnet(load / size, inertia, ratio)

    return Cause("stepper_compliance", "motors", (max(0.01, load / STRONGEST), 1 / HOLDS[0]),
                 lambda s: {"holding_torque": load / s, "damping": magnet(s).damping},
                 lambda s: Acts(beside=Beside(magnet=magnet(s))))  # fmt: skip


def _detent_torque(random: Random, about: About) -> Cause:
    """Detent torque over the holding torque [1]; without it the magnetic spring stays."""
    inertia, ratio = spread(random, *INERTIA), spread(random, *DAMPED)
    phase = float(random.uniform(-np.pi, np.pi))
    spring = _magnet(_load(about, inertia) * spread(random, *HOLDS), inertia, ratio)

    def acts(size: float) -> Acts:
        magnet = spring._replace(detent=size * spring.holding, phase=phase)
        return Acts(beside=Beside(magnet=magnet))

    return Cause("detent_torque", "motors", (1e-3, COGGED),
                 lambda s: {"torque": s * spring.holding, "phase": phase},
                 acts, without=acts(0.0))  # fmt: skip


def _rippled(
    random: Random, order: float, reach: float
) -> tuple[str, float, Callable[[float], Acts]]:
    """A place, at one motor or both, a phase, and what an error of the belt's angle does there, per
    ``reach``.
    """
    motor, phase = int(random.integers(3)), float(random.uniform(-np.pi, np.pi))

    def acts(size: float) -> Acts:
        swing = size / reach
        swings = (swing, swing) if motor == 2 else pair(motor, swing, 0.0)
        return Acts(beside=Beside(ripple=Ripple(swings, order, phase)))

    return ("motor1", "motor2", "motors")[motor], phase, acts


def _microstep_error(random: Random, about: About) -> Cause:
    """Amplitude of an error of the rotor's angle, once an electrical cycle [rad]."""
    place, phase, acts = _rippled(random, POLES, 1.0)
    return Cause("microstep_error", place, (1e-5, 0.02),
                 lambda s: {"amplitude": s, "phase": phase}, acts)  # fmt: skip


def _tooth_ripple(random: Random, about: About) -> Cause:
    """Amplitude of an error at the belt, once a tooth [m]."""
    radius = about.machine.numbers["r"]
    teeth = float(round(2 * np.pi * radius / random.choice(PITCHES)))
    place, phase, acts = _rippled(random, teeth, radius)
    return Cause("tooth_ripple", place, (1e-6, 3e-4),
                 lambda s: {"amplitude": s, "phase": phase, "teeth": teeth}, acts)  # fmt: skip


ROTORS = (_stepper_compliance, _detent_torque, _microstep_error, _tooth_ripple)
