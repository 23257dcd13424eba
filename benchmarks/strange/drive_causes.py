"""Causes in drives, belts and sensor.  A docstring has the unit of a size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.shop.stage import Array, Faults
from benchmarks.strange.cause import FILES, About, Cause, Parameters, columns, pair, sign_of
from benchmarks.strange.machines import Random
from benchmarks.strange.running import Acts

FULL_STEP, LASTS = np.radians(1.8), 2e-3  # [rad]; [s] that a rotor takes to its new place
Shows = Callable[[float, Array, Array], Array]  # size, time [s], x and y [m]


def _backlash(random: Random, about: About) -> Cause:
    """Play of one motor's pulley on its shaft [rad]."""
    motor = int(random.integers(2))

    def acts(size: float) -> Acts:
        return Acts(lambda n, t: Faults(play=pair(motor, size, -1.0)), loose=True)

    return Cause("backlash", f"motor{motor + 1}", (1e-3, 0.2), lambda s: {"gap": s}, acts)


def _belt_mismatch(random: Random, about: About) -> Cause:
    """Stiffness of one belt over the other, less one [1]."""
    sign = sign_of(random)

    def ratio(size: float) -> float:
        return size if sign > 0 else 1 / (1 + size) - 1

    def acts(size: float) -> Acts:
        rho = ratio(size)
        first, second = (2 + 2 * rho) / (2 + rho), 2 / (2 + rho)
        return Acts(lambda n, t: Faults(sections=(first,) * 6 + (second,) * 6))

    return Cause("belt_mismatch", "belts", (0.01, 2.2), lambda s: {"ratio": ratio(s)}, acts)


def _missed_steps(random: Random, about: About) -> Cause:
    """Full steps [1], lost once in one recording to fit, and often in the others."""
    motor, sign = int(random.integers(2)), sign_of(random)
    at = {n: float(t[-1] * random.uniform(0.25, 0.7)) for n, (t, _) in enumerate(about.motions)}
    kept = {int(random.integers(2))} | {n for n in at if random.random() < 0.5}

    def acts(size: float) -> Acts:
        def played(n: int, time: Array, phi: Array) -> Array:
            done = np.clip((time - at[n]) / LASTS, 0, 1) * (n in kept)
            return phi + columns(motor, sign * size * FULL_STEP * (3 * done**2 - 2 * done**3), 0.0)

        return Acts(played=played)

    told = {f"time@{FILES[n]}": at[n] for n in sorted(kept)}
    return Cause("missed_steps", f"motor{motor + 1}", (1.0, 100.0),
                 lambda s: {"steps": sign * s, **told}, acts, whole=True)  # fmt: skip


def _pulley_eccentricity(random: Random, about: About) -> Cause:
    """Half of the run-out of a motor's pulley, peak to peak [m]."""
    motor, phase = int(random.integers(2)), float(random.uniform(-np.pi, np.pi))
    radius = about.machine.numbers["r"]

    def acts(size: float) -> Acts:
        def played(n: int, time: Array, phi: Array) -> Array:
            off = np.sin(phi[:, motor] + phase) - np.sin(phase)
            return phi + columns(motor, size / radius * off, 0.0)

        return Acts(played=played)

    return Cause("pulley_eccentricity", f"motor{motor + 1}", (2e-6, 1e-3),
                 lambda s: {"amplitude": s, "phase": phase}, acts)  # fmt: skip


def seen_by(name: str, highest: float, unit: Callable[[float], Parameters], shows: Shows) -> Cause:
    """A cause in the sensor: places over fine time, at a size, to what is reported."""

    def acts(size: float) -> Acts:
        return Acts(shown=lambda n, time, xy: shows(size, time, xy))

    return Cause(name, "sensor", (1e-6, highest), unit, acts)


def _sensor_delay(random: Random, about: About) -> Cause:
    """Samples late by a time [s]."""

    def shows(size: float, time: Array, xy: Array) -> Array:
        return np.column_stack([np.interp(time - size, time, p) for p in xy.T])

    return seen_by("sensor_delay", 0.05, lambda s: {"delay": s}, shows)


def _axis_skew(random: Random, about: About) -> Cause:
    """Axes that are off a right angle [rad]."""
    sign = sign_of(random)

    def shows(size: float, time: Array, xy: Array) -> Array:
        return xy - sign * size * columns(0, xy[:, 1], 0.0)

    return seen_by("axis_skew", 0.1, lambda s: {"angle": sign * s}, shows)


def _sensor_rotation(random: Random, about: About) -> Cause:
    """A sensor that is turned [rad]."""
    sign = sign_of(random)

    def shows(size: float, time: Array, xy: Array) -> Array:
        return xy + sign * size * xy[:, ::-1] * np.array([-1.0, 1.0])

    return seen_by("sensor_rotation", 0.1, lambda s: {"angle": sign * s}, shows)


def _sensor_scale(random: Random, about: About) -> Cause:
    """A gain of each axis, off by this [1] for the one that is worse."""
    off = np.array(pair(int(random.integers(2)), 1.0, random.uniform(-1, 1))) * sign_of(random)

    def shows(size: float, time: Array, xy: Array) -> Array:
        return xy * (1 + size * off)

    def told(size: float) -> Parameters:
        return {"scale_x": float(1 + size * off[0]), "scale_y": float(1 + size * off[1])}

    return seen_by("sensor_scale", 0.19, told, shows)


DRIVES = (_backlash, _belt_mismatch, _missed_steps, _pulley_eccentricity)
SENSORS = (_sensor_delay, _axis_skew, _sensor_rotation, _sensor_scale)
