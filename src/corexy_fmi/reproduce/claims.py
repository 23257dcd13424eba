"""Each of the paper's claims as a criterion on what was measured.

The thresholds are this project's: the paper states its claims in words.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.rectangle import TURNS
from corexy_fmi.reproduce.measure import INTERVALS, SETTLED, Measures
from corexy_fmi.reproduce.paper import SPEEDS

Flags = NDArray[np.bool_]
Array = NDArray[np.float64]
CLEAN, OVERSHOOT = 0.05, 0.10  # of the contour error
STRAIGHT = 0.05  # of the largest error, left by a straight line
NEARLY, MASS = 0.25, 0.25  # of an exponent: from 1 or -1, from 0
PULSE_LIMIT = np.sqrt(2) * SETTLED  # an axis off by 5 % of a step, along the 45-degree line
CRITERIA = {
    "a": f"all errors positive; waviness of the last half side below {CLEAN:.0%} and overshoot "
    f"below {OVERSHOOT:.0%} of them",
    "b": "at all three speeds",
    "c": f"rising, off a line by at most {STRAIGHT:.0%} of the largest, both turns",
    "d": "error full - 4-DoF positive, rising with speed, larger from y to x, at all three speeds",
    "e": f"exponents from x to y: mass within {MASS} of 0, friction within {NEARLY} of 1, "
    f"stiffness within {NEARLY} of -1",
    "f": f"settled within 0.5 s; beyond that time error below {PULSE_LIMIT:.1%} of a full step "
    "(one axis 5 % of a step off), both turns",
}
JUDGED = (*"abcde", "f without Coulomb friction", "f with Coulomb friction")


def judge(m: Measures) -> dict[str, Flags]:
    """Whether each claim holds, (sets,) by the names of `JUDGED`."""
    with np.errstate(invalid="ignore"):
        return {
            "a": rounded(m),
            "b": np.all(m.error["full", "x->y"] > m.error["full", "y->x"], axis=1),
            "c": np.all([linear(m.error["full", turn]) for turn in TURNS], axis=0),
            "d": full_above(m),
            "e": proportional(m),
            JUDGED[5]: settled(m, "without"),
            JUDGED[6]: settled(m, "with"),
        }


def rounded(m: Measures) -> Flags:
    """(a)"""
    fine = []
    for turn in TURNS:
        error = m.error["full", turn]
        clean = (m.waviness[turn] < CLEAN * error) & (m.overshoot[turn] < OVERSHOOT * error)
        fine.append((error > 0) & clean)
    return np.all(fine, axis=(0, 2))


def line_through(error: Array) -> tuple[Array, Array, Array]:
    """Slope [m per m/s], intercept [m] (sets,) and what is left (sets, speeds)."""
    speeds = np.array(SPEEDS)
    away = speeds - speeds.mean()
    slope = error @ away / (away @ away)
    intercept = error.mean(axis=1) - slope * speeds.mean()
    return slope, intercept, error - np.outer(slope, speeds) - intercept[:, None]


def linear(error: Array) -> Flags:
    """(c) for one turn."""
    slope, _, left = line_through(error)
    return (slope > 0) & (np.abs(left).max(axis=1) <= STRAIGHT * np.abs(error).max(axis=1))


def full_above(m: Measures) -> Flags:
    """(d)"""
    gap = {turn: m.error["full", turn] - m.error["4-DoF", turn] for turn in TURNS}
    above = [np.all((g > 0) & (np.diff(g, axis=1, prepend=0) > 0), axis=1) for g in gap.values()]
    return np.all(above, axis=0) & np.all(gap["y->x"] > gap["x->y"], axis=1)


def proportional(m: Measures) -> Flags:
    """(e)"""
    mass, stiffness, friction = (m.exponent[g, "x->y"] for g in ("mass", "stiffness", "friction"))
    near = (np.abs(friction - 1) < NEARLY) & (np.abs(stiffness + 1) < NEARLY)
    return near & (np.abs(mass) < MASS)


def settled(m: Measures, friction: str) -> Flags:
    """(f)"""
    fine = []
    for turn in TURNS:
        need = m.settling[turn[0]][:, None]
        late = np.array(INTERVALS) >= need
        small = np.abs(m.pulsed[friction, turn]) < PULSE_LIMIT
        fine.append(late.any(axis=1) & np.all(small | ~late, axis=1))
    return np.all(fine, axis=0)
