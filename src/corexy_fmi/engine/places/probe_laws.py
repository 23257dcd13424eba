"""Simple functions of a motion by which a place may be off: what probes are made of.

None of them is a law of the catalogue; together they span what a place can do that is smooth, goes
with a turn of a motor, or changes with the direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.naming.candidates import PLACE_KNOTS, SPEED_KNOTS, TIME_KNOTS
from corexy_fmi.engine.naming.spread import TIMES
from corexy_fmi.kernel.call import Array

WAVES = (*range(1, 61), 100, 200)  # over a turn of a motor
NEAR_ZERO = (0.003, 0.01, 0.03, 0.1)  # shares of a motor's largest voltage that count as small
OF_VOLTS = (*range(1, 26), 50, 100, 200)  # the same of a dc motor's torque
SLOW = 0.02  # share of the highest speed over which a direction turns
FADES = (1.0, 4.0, 16.0)  # [s] of what fades from the beginning
CREEPS = (0.02, 0.1, 0.5, 2.0)  # [s] of what follows a load late
FINE = 49  # knots over an axis' places: what a spot on a rail needs
TONE = "a tone of"  # how the words of a frequency begin that was read off the mismatch itself
PLAYS = (2e-5, 1e-4, 5e-4)  # [m] of what turns before it slides

Function = tuple[str, str, list[Array]]  # state (CONTRACT 4), word, values (rows,) of each run


@dataclass(frozen=True, eq=False)
class Motion:
    """The retuned motion of a run, (rows,) each: time, axes and motors with their speeds, the
    stretch [m] of both belts from clip to motor, the motors' voltages.
    """

    time: Array
    place: dict[str, Array]
    speed: dict[str, Array]
    stretch: tuple[Array, Array]
    voltage: dict[str, Array]


def direction(speed: Array) -> Array:
    """-1 .. 1 (rows,): which way it goes."""
    return np.tanh(speed / (SLOW * float(np.abs(speed).max()) + 1e-12))


def play(place: Array, width: float) -> Array:
    """What follows a place (rows,) within half a width [m] of it, less that place."""
    follower, found = place[0], np.empty_like(place)
    for n, p in enumerate(place.tolist()):
        follower = min(max(follower, p - width / 2), p + width / 2)
        found[n] = follower - p
    return found


def _hats(values: list[Array], knots: Array) -> list[list[Array]]:
    """For each knot the hat function over it, of every run."""
    return [[np.interp(v, knots, row) for v in values] for row in np.eye(len(knots))]


def _range(values: list[Array], count: int) -> Array:
    low, high = min(v.min() for v in values), max(v.max() for v in values)
    return np.linspace(low, high if high > low else low + 1.0, count)


def of_motor(runs: list[Motion], motor: str) -> Iterator[Function]:
    """Functions by which a motor's angle may be off."""
    angles, speeds = [m.place[motor] for m in runs], [m.speed[motor] for m in runs]
    for k in WAVES:
        yield "motor_angle", f"{k} waves a turn", [np.sin(k * a) for a in angles]
        yield "motor_angle", f"{k} waves a turn", [np.cos(k * a) for a in angles]
    yield "velocity_reversal", "direction", [direction(v) for v in speeds]
    drawn = [m.stretch[int(motor[-1]) - 1] for m in runs]
    yield "velocity_reversal", "which way its belt pulls", [direction(d) for d in drawn]
    yield "speed", "speed", speeds
    yield "speed", "squared speed", [v * np.abs(v) for v in speeds]
    for r, run in enumerate(runs):
        for t in np.linspace(run.time[0], run.time[-1], TIMES + 2)[1:-1]:
            yield (
                "time",
                f"a jump near {t:.1f} s",
                [(m.time > t) * float(q == r) for q, m in enumerate(runs)],
            )


def of_voltage(runs: list[Motion], motor: str) -> Iterator[Function]:
    """Functions by which the voltage that a motor gets may be off."""
    angles, volts = [m.place[motor] for m in runs], [m.voltage[motor] for m in runs]
    for k in OF_VOLTS:
        for turn in (np.sin, np.cos):
            waves = [turn(k * a) for a in angles]
            yield "motor_angle", f"{k} waves a turn", waves
            yield (
                "motor_angle",
                f"{k} waves a turn, times the voltage",
                [w * v for w, v in zip(waves, volts, strict=True)],
            )
    yield "voltage", "its sign", [direction(v) for v in volts]
    most = max(float(np.abs(v).max()) for v in volts) or 1.0
    for share in NEAR_ZERO:
        small = [v / (share * most) for v in volts]
        yield "voltage", "what is small of it", [v * np.exp(-(v**2)) for v in small]
    yield "voltage", "its cube", [v**3 for v in volts]
    yield "voltage", "its rate", [np.gradient(v, m.time) for v, m in zip(volts, runs, strict=True)]


def of_axis(runs: list[Motion], axis: str, heard: tuple[float, ...]) -> Iterator[Function]:
    """Functions that a force on an axis may be; ``heard``: tones [Hz] of the mismatch, which have a
    phase of their own in every run.
    """
    other = "y" if axis == "x" else "x"
    places, speeds = [m.place[axis] for m in runs], [m.speed[axis] for m in runs]
    turns = [direction(v) for v in speeds]
    top = max(float(np.quantile(np.abs(v), 0.99)) for v in speeds) or 1.0
    for hat in _hats(speeds, top * np.array(SPEED_KNOTS)):
        yield "speed", "speed", hat
    for hat in _hats(places, _range(places, PLACE_KNOTS)):
        yield "position", "position", hat
        yield "position", "friction by position", [h * d for h, d in zip(hat, turns, strict=True)]
    yield "constant", "a steady pull", [np.ones_like(p) for p in places]
    yield "position", "a spring", places
    spots = _range(places, FINE)
    for spot, hat in zip(spots, _hats(places, spots), strict=True):
        near = f"{axis} near {1e3 * spot:.0f} mm"
        yield "position", near, hat
        yield "position", f"friction at {near}", [h * d for h, d in zip(hat, turns, strict=True)]
    for width in PLAYS:
        yield "velocity_reversal", "way since the last turn", [play(p, width) for p in places]
    for word, pulls in _pulls(runs, axis):
        loaded = [np.abs(pull) * d for pull, d in zip(pulls, turns, strict=True)]
        yield "load", f"friction by the pull {word}", loaded
    for fade in FADES:
        yield (
            "time",
            "fading friction",
            [np.exp(-(m.time - m.time[0]) / fade) * d for m, d in zip(runs, turns, strict=True)],
        )
    for hat in _hats([m.time for m in runs], _range([m.time for m in runs], TIME_KNOTS)):
        yield "time", "time", hat
    for f, wave, own in product(heard, (np.sin, np.cos), range(len(runs))):
        tone = [wave(2 * np.pi * f * m.time) * float(r == own) for r, m in enumerate(runs)]
        yield "time", f"{TONE} {f:.3g} Hz", tone
    yield "speed", f"speed of {other}", [m.speed[other] for m in runs]


def _pulls(runs: list[Motion], axis: str) -> Iterator[tuple[str, list[Array]]]:
    """Stretches [m] by which the belts load an axis' guide: of each, and along it and across."""
    for n in (0, 1):
        yield f"of belt {n + 1}", [m.stretch[n] for m in runs]
    alike, apart = ("along", "across") if axis == "x" else ("across", "along")
    yield alike, [m.stretch[0] + m.stretch[1] for m in runs]
    yield apart, [m.stretch[0] - m.stretch[1] for m in runs]


def of_belt(runs: list[Motion], belt: int) -> Iterator[Function]:
    """Functions by which a belt may be longer than its load says."""
    drawn = [(m.stretch[belt], m.time) for m in runs]
    for power, word in ((1, "pull"), (2, "squared pull"), (3, "cubed pull")):
        yield "load", word, [d**power for d, _ in drawn]
    yield "load", "size of the pull", [np.abs(d) for d, _ in drawn]
    yield "load", "rate of the pull", [np.gradient(d, t) for d, t in drawn]
    for axis in ("x", "y"):
        places = [m.place[axis] for m in runs]
        for power in (1, 2, 3):
            by_place = [d * p**power for (d, _), p in zip(drawn, places, strict=True)]
            yield "load", f"pull by position {axis}", by_place
    for creep in CREEPS:
        yield "load", "pull of a while ago", [_late(d, t, creep) for d, t in drawn]


def of_idler(runs: list[Motion], radius: float) -> Iterator[Function]:
    """Functions by which an idler on the bridge may be off its centre."""
    for turn in (np.sin, np.cos):
        yield "motor_angle", "a wave a turn", [turn(m.place["x"] / radius) for m in runs]


def _late(values: Array, time: Array, constant: float) -> Array:
    """Values through a first-order lag [s]; rows are taken for even."""
    share = float(1 - np.exp(-np.median(np.diff(time)) / constant))
    found, _ = lfilter([share], [1, share - 1], values, zi=[(1 - share) * values[0]])
    return np.asarray(found)
