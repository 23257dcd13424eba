"""Causes in the sensor that only a round of the rest draws, and all of that round."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from benchmarks.shop.stage import Array
from benchmarks.strange.belt_causes import BELTS
from benchmarks.strange.body_causes import BODIES
from benchmarks.strange.cause import About, Cause, Draws, sign_of
from benchmarks.strange.drive_causes import seen_by
from benchmarks.strange.machines import Random
from benchmarks.strange.rotor_causes import ROTORS


def _sensor_lag(random: Random, about: About) -> Cause:
    """Time constant of a filter of first order [s], exact for places that are linear between."""

    def shows(size: float, time: Array, xy: Array) -> Array:
        h = float(time[1] - time[0])
        stays, share = np.exp(-h / size), -np.expm1(-h / size) * size / h
        taps = [1 - share, share - stays]
        return np.asarray(lfilter(taps, [1, -stays], xy - xy[0], axis=0)) + xy[0]

    return seen_by("sensor_lag", 0.05, lambda s: {"time_constant": s}, shows)


def _clock_drift(random: Random, about: About) -> Cause:
    """A stamp t was taken at t (1 + ratio) [1]."""
    sign = sign_of(random)

    def shows(size: float, time: Array, xy: Array) -> Array:
        taken = time * (1 + sign * size)
        return np.column_stack([np.interp(taken, time, p) for p in xy.T])

    return seen_by("clock_drift", 0.02, lambda s: {"ratio": sign * s}, shows)


CLOCKS = (_sensor_lag, _clock_drift)
REST: tuple[Draws, ...] = BELTS + ROTORS + BODIES + CLOCKS
