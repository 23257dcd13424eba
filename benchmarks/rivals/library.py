"""Candidate functions of the motion: the catalogue's laws as forces on an axis, and what they need.

An effect with an unknown inside (a gap, a speed, a frequency) is there at several values of it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.rivals.common import Array

NOMINAL = "nominal"
GAPS, SPEEDS, MODES = (0.01, 0.02, 0.04), (0.003, 0.015), (6.0, 12.0, 24.0, 48.0)
STOPPED = 2e-4  # [m/s] below which a direction is not sure


def play(angle: Array, gap: float) -> Array:
    """What a loose pulley lags behind (n,) [rad]: the play operator of the textbooks."""
    out, at = np.empty_like(angle), angle[0]
    for k, now in enumerate(angle.tolist()):
        at = min(max(at, now - gap / 2), now + gap / 2)
        out[k] = at - now
    return out


def ringing(push: Array, time: Array, frequency: float) -> Array:
    """A lightly damped mode driven by an acceleration (n,) [m/s^2]: its own acceleration."""
    omega, out, place, pace = 2 * np.pi * frequency, np.zeros_like(push), 0.0, 0.0
    for k in range(1, len(push)):
        step = time[k] - time[k - 1]
        surge = -push[k] - omega**2 * place - 0.1 * omega * pace
        pace += step * surge
        place += step * pace
        out[k] = omega**2 * place
    return out


def direction(speed: Array) -> Array:
    """Sign of a speed, soft around rest."""
    return np.tanh(speed / STOPPED)


def motor_columns(phi: Array) -> dict[tuple[str, str], Array]:
    """Candidates that follow from the commanded angles (rows, 2) [rad] alone."""
    out: dict[tuple[str, str], Array] = {}
    for m in (1, 2):
        a = phi[:, m - 1]
        for gap in GAPS:
            out["backlash", f"play{m} {gap:g}"] = play(a, gap)
        out["pulley_eccentricity", f"sin phi{m}"] = np.sin(a)
        out["pulley_eccentricity", f"cos phi{m}"] = np.cos(a)
        out["tooth_ripple", f"sin 20 phi{m}"] = np.sin(20 * a)
        out["tooth_ripple", f"cos 20 phi{m}"] = np.cos(20 * a)
    return out


def axis_columns(
    name: str, place: Array, speed: Array, along: Array, across: Array, time: Array
) -> dict[tuple[str, str], Array]:
    """Candidates of one axis: place [m], speed [m/s], pull along and across it [m of belt]."""
    way, size = direction(speed), np.abs(speed)
    out = {
        (NOMINAL, f"v{name}"): speed,
        (NOMINAL, f"sign v{name}"): way,
        (NOMINAL, f"a{name}"): np.gradient(speed, time),
        (NOMINAL, f"pull {name}"): along,
        ("quadratic_drag", f"v{name}|v{name}|"): speed * size,
        ("load_friction", f"|pull| sign v{name}"): np.abs(across) * way,
        ("friction_vs_position", f"{name} sign v{name}"): place * way,
        ("friction_vs_position", f"{name}^2 sign v{name}"): place**2 * way,
        ("cable_drag", name): place,
    }
    for slow in SPEEDS:
        out["stribeck_friction", f"exp v{name} {slow:g}"] = way * np.exp(-((speed / slow) ** 2))
    return out


def columns(
    phi: Array, moved: Array, radius: float, time: Array, fixed: Mapping[tuple[str, str], Array]
) -> dict[tuple[str, str], Array]:
    """All candidates at positions (rows, 2) [m]: (effect, term) -> (rows,).

    ``fixed`` are those of the commanded angles, which do not change with the positions.
    """
    speed = np.gradient(moved, time, axis=0)
    x, y = moved.T
    travel = radius * phi
    pull1, pull2 = x + y - travel[:, 0], x - y - travel[:, 1]
    out = {("constant_force", "1"): np.ones(len(x))}
    out |= axis_columns("x", x, speed[:, 0], pull1 + pull2, pull1 - pull2, time)
    out |= axis_columns("y", y, speed[:, 1], pull1 - pull2, pull1 + pull2, time)
    for n, pull in ((1, pull1), (2, pull2)):
        out |= {
            ("belt_mismatch", f"e{n}"): pull,
            ("belt_stiffness_vs_position", f"e{n} x"): pull * x,
            ("belt_stiffness_vs_position", f"e{n} y"): pull * y,
            ("belt_hardening", f"e{n}|e{n}|"): pull * np.abs(pull),
            ("belt_damping", f"de{n}"): np.gradient(pull, time),
        }
    return out | dict(fixed)


def mode_columns(phi: Array, radius: float, time: Array) -> dict[tuple[str, str], Array]:
    """A tool's or a frame's ringing under the commanded acceleration of each axis."""
    travel = radius * phi
    path = np.column_stack([travel.sum(axis=1), travel[:, 0] - travel[:, 1]]) / 2
    push = np.gradient(np.gradient(path, time, axis=0), time, axis=0)
    return {
        ("tool_mode or frame_mode", f"ring {axis} {f:g}"): ringing(push[:, k], time, f)
        for k, axis in enumerate("xy")
        for f in MODES
    }
