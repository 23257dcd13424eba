"""Causes that act at x or y: forces and friction.  A docstring has the unit of a size."""

from __future__ import annotations

import numpy as np

from benchmarks.shop.stage import Array, Faults
from benchmarks.strange.cause import FILES, About, Cause, axis_of, columns, law, pair, sign_of
from benchmarks.strange.machines import Random, spread
from benchmarks.strange.running import Acts

KNOTS = 2001  # of a law over position


def _constant_force(random: Random, about: About) -> Cause:
    """The same force at all times [N]."""
    (axis, place), sign = axis_of(random), sign_of(random)

    def acts(size: float) -> Acts:
        return Acts(lambda n, t: Faults(push=columns(axis, np.full(len(t), sign * size), 0.0)))

    return Cause("constant_force", place, (0.02, 30.0), lambda s: {"force": sign * s}, acts)


def _friction_vs_position(random: Random, about: About) -> Cause:
    """More friction [N] at a spot that the first recording passes."""
    axis, place = axis_of(random)
    passed = about.motions[0][1][:, axis]
    center, width = float(random.choice(passed)), spread(random, 3e-3, 4e-2)
    reach = about.machine.half[axis] + 5 * width
    spot = np.exp(-(((np.linspace(-reach, reach, KNOTS) - center) / width) ** 2) / 2)

    def acts(size: float) -> Acts:
        rows = law(axis, size * spot)
        return Acts(lambda n, t: Faults(spot=rows, reach=reach))

    return Cause("friction_vs_position", place, (0.05, 30.0),
                 lambda s: {"extra": s, "center": center, "width": width}, acts)  # fmt: skip


def _stribeck_friction(random: Random, about: About) -> Cause:
    """Breakaway over Coulomb's friction, less one [1]; it fades as exp(-v/v_s)."""
    (axis, place), speed = axis_of(random), spread(random, 2e-3, 5e-2)

    def acts(size: float) -> Acts:
        return Acts(lambda n, t: Faults(breakaway=pair(axis, 1 + size, 1.0), fades=speed))

    return Cause("stribeck_friction", place, (0.1, 5.0),
                 lambda s: {"static_ratio": 1 + s, "speed": speed, "pointed": 1.0},
                 acts)  # fmt: skip


def _cable_drag(random: Random, about: About) -> Cause:
    """A spring [N/m] to a place within the stage."""
    axis, place = axis_of(random)
    center = float(random.uniform(-1, 1)) * about.machine.half[axis]
    ends = np.array([-1.0, 1.0])  # [m]

    def acts(size: float) -> Acts:
        rows = law(axis, -size * (ends - center))
        return Acts(lambda n, t: Faults(pull=rows, reach=1.0))

    return Cause("cable_drag", place, (0.5, 500.0),
                 lambda s: {"stiffness": s, "center": center}, acts)  # fmt: skip


def _periodic_disturbance(random: Random, about: About) -> Cause:
    """A sine [N], its phase another in each recording."""
    axis, place = axis_of(random)
    hertz, phases = spread(random, 2.0, 40.0), random.uniform(-np.pi, np.pi, 3)
    told = {"frequency": hertz} | {
        f"phase@{f}": float(p) for f, p in zip(FILES, phases, strict=True)
    }

    def acts(size: float) -> Acts:
        def faults(n: int, time: Array) -> Faults:
            wave = size * np.sin(2 * np.pi * hertz * time + phases[n])
            return Faults(push=columns(axis, wave, 0.0))

        return Acts(faults)

    return Cause("periodic_disturbance", place, (0.01, 30.0),
                 lambda s: {"amplitude": s, **told}, acts)  # fmt: skip


def _quadratic_drag(random: Random, about: About) -> Cause:
    """A force -c v |v|, c in N s^2/m^2."""
    axis, place = axis_of(random)

    def acts(size: float) -> Acts:
        return Acts(lambda n, t: Faults(windage=pair(axis, size, 0.0)))

    return Cause("quadratic_drag", place, (1.0, 2000.0), lambda s: {"coefficient": s}, acts)


def _friction_warmup(random: Random, about: About) -> Cause:
    """More Coulomb friction where each recording begins, over the warm one [1]."""
    (axis, place), constant = axis_of(random), spread(random, 1.0, 8.0)

    def acts(size: float) -> Acts:
        def faults(n: int, time: Array) -> Faults:
            grip = 1 + size * np.exp(-np.maximum(time, 0.0) / constant)
            return Faults(grip=columns(axis, grip, 1.0))

        return Acts(faults)

    return Cause("friction_warmup", place, (0.1, 15.0),
                 lambda s: {"extra_ratio": s, "time_constant": constant}, acts)  # fmt: skip


LOADS = (
    _constant_force, _friction_vs_position, _stribeck_friction, _cable_drag,
    _periodic_disturbance, _quadratic_drag, _friction_warmup,
)  # fmt: skip
