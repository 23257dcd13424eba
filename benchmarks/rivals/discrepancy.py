"""Discrepancy modelling by pysindy: what the retuned model's acceleration lacks, as sparse terms.

Kaheman, Kaiser, Strom, Kutz, Brunton, "Learning discrepancy models from experimental data", 2019:
the measured state is smoothed and differentiated, the model's acceleration at that state is taken
off, and SINDy finds the rest among candidates.  The model is the 4-DoF one with condensed idlers
(those of the full one are not measured); its correction is put on top of the full one's response.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from scipy.signal import savgol_filter

from benchmarks.rivals.common import Array, Ground, Part, corrected
from benchmarks.rivals.library import NOMINAL, columns, mode_columns, motor_columns
from benchmarks.rivals.sparse import SETTINGS, Setting, beside, criterion
from corexy_fmi.topology.corexy import CONDENSED

WINDOWS = (0.04, 0.1)  # [s] of the smoothing polynomial
SUBSTEPS, PASSES = 4, 2
SMALL = 5e-6  # [m] that a candidate moves the stage by in the integral form


@dataclass(frozen=True)
class Lumped:
    """The 4-DoF model of one machine: (2,) masses, viscous and dry friction; stiffness; radius."""

    mass: Array
    viscous: Array
    dry: Array
    stiffness: float
    radius: float

    @classmethod
    def of(cls, parameters: Any) -> Lumped:
        """With the constants of a machine's parameters."""
        c = CONDENSED.constants(parameters, 0.0)
        first = (np.array(a[:2], dtype=float) for a in (c.mass, c.viscous, c.coulomb))
        return cls(*first, float(c.stiffness[0]), parameters["pulley_radius"])

    def acceleration(self, place: Array, speed: Array, phi: Array) -> Array:
        """At a state, (rows, 2) [m/s^2]."""
        travel = self.radius * phi
        e1 = place[:, 0] + place[:, 1] - travel[:, 0]
        e2 = place[:, 0] - place[:, 1] - travel[:, 1]
        pull = -self.stiffness * np.column_stack([e1 + e2, e1 - e2])
        slide = self.viscous * speed + self.dry * np.tanh(speed / 2e-4)
        return np.asarray((pull - slide) / self.mass)


@njit(cache=True)
def moved(mass, viscous, dry, stiffness, travel, time, extra, substeps):  # type: ignore[no-untyped-def]
    """x, y (rows, 2) [m] under belt travel (rows, 2) [m] and more acceleration (rows, 2)."""
    out = np.empty_like(travel)
    q = np.array([(travel[0, 0] + travel[0, 1]) / 2, (travel[0, 0] - travel[0, 1]) / 2])
    v, out[0] = np.zeros(2), q
    for row in range(len(time) - 1):
        h = (time[row + 1] - time[row]) / substeps
        for n in range(substeps):
            share = (n + 0.5) / substeps
            one = travel[row, 0] + share * (travel[row + 1, 0] - travel[row, 0])
            two = travel[row, 1] + share * (travel[row + 1, 1] - travel[row, 1])
            q += h / 2 * v
            e1, e2 = q[0] + q[1] - one, q[0] - q[1] - two
            for i in range(2):
                pull = -stiffness * (e1 + e2 if i == 0 else e1 - e2)
                more = extra[row, i] + share * (extra[row + 1, i] - extra[row, i])
                fast = v[i] + h * ((pull - viscous[i] * v[i]) / mass[i] + more)
                slip = h * dry[i] / mass[i]
                v[i] = fast - min(max(fast, -slip), slip)
            q += h / 2 * v
        out[row + 1] = q
    return out


def response(model: Lumped, part: Part, extra: Array) -> Array:
    """How a further acceleration (rows, 2) [m/s^2] moves the stage (rows, 2) [m]."""
    travel = model.radius * part.travel
    given = (model.mass, model.viscous, model.dry, model.stiffness, travel, part.time)
    return np.asarray(
        moved(*given, extra, SUBSTEPS) - moved(*given, np.zeros_like(extra), SUBSTEPS)
    )


def measured_state(part: Part, window: float) -> tuple[Array, ...]:
    """Rows of the samples, and place, speed, acceleration there (n, 2), smoothed over [s].

    What is smoothed is the measured distance from the model's response, which is differentiated
    without noise.
    """
    rows = np.flatnonzero(np.isfinite(part.left).all(axis=1))
    step = float(np.median(np.diff(part.time[rows])))
    grid = np.arange(part.time[rows[0]], part.time[rows[-1]], step)
    even = np.column_stack([np.interp(grid, part.time[rows], c) for c in part.left[rows].T])
    length = max(round(window / step) // 2 * 2 + 1, 5)
    at = np.clip(np.searchsorted(part.time, grid), 0, len(part.time) - 1)
    out = []
    for order, names in enumerate((("x", "y"), ("vx", "vy"), ("ax", "ay"))):
        said = np.column_stack([part.said[n] for n in names])[at]
        out.append(
            said + savgol_filter(even, length, 3, deriv=order, delta=step, axis=0, mode="interp")
        )
    return at, *out


class Candidates:
    """The library of one recording; what follows from the command is computed once."""

    def __init__(self, part: Part, model: Lumped) -> None:
        self.part, self.model = part, model
        phi, time = part.travel, part.time
        self.said = np.column_stack([part.said["x"], part.said["y"]])
        self.fixed = motor_columns(phi) | mode_columns(phi, model.radius, time)
        self.names = list(self.at(self.said))

    def at(self, place: Array) -> dict[tuple[str, str], Array]:
        """All candidates at positions (rows, 2) [m] of every row."""
        part = self.part
        return columns(part.travel, place, self.model.radius, part.time, self.fixed)

    def matrix(self, place: Array) -> Array:
        """The same as (rows, candidates)."""
        return np.column_stack(list(self.at(place).values()))


def correction(found: Array, one: Candidates) -> Array:
    """What the terms (2, candidates) do to the response (rows, 2) [m]."""
    change = np.zeros_like(one.said)
    for _ in range(PASSES):
        change = response(one.model, one.part, one.matrix(one.said + change) @ found.T)
    return change


def differentiated(one: Candidates, window: float) -> tuple[Array, Array]:
    """Candidates (n, candidates) and what the model's acceleration lacks (n, 2) at the samples."""
    at, place, speed, acceleration = measured_state(one.part, window)
    part, said = one.part, one.said
    apart = [np.interp(part.time, part.time[at], c) for c in (place - said[at]).T]
    theta = one.matrix(said + np.column_stack(apart))[at]
    return theta, acceleration - one.model.acceleration(place, speed, part.travel[at])


def integral(one: Candidates) -> tuple[Array, Array]:
    """What each candidate on either axis does to the response at the samples (n, 2 candidates),
    and what the response lacks there (n,): no derivative is taken.
    """
    theta, columns = one.matrix(one.said), []
    scale = SMALL * 2 * one.model.stiffness / one.model.mass
    seen = one.part.used
    for axis in (0, 1):
        for column in theta.T:
            size = scale[axis] / (np.sqrt(np.mean(column**2)) + 1e-12)
            extra = np.zeros((len(theta), 2))
            extra[:, axis] = size * column
            change = response(one.model, one.part, extra)
            parts = [c[s] - c[s].mean() for c, s in zip(change.T, seen.T, strict=True)]
            columns.append(np.concatenate(parts) / size)
    left = [c[s] for c, s in zip(one.part.left.T, seen.T, strict=True)]
    return np.column_stack(columns), np.concatenate(left)[:, None]


def left_by(found: Array, ones: Sequence[Candidates]) -> float:
    """Rms [m] that terms leave; infinite where the corrected model runs away."""
    with np.errstate(all="ignore"):
        value = corrected([o.part for o in ones], [correction(found, o) for o in ones])
    return value if np.isfinite(value) else np.inf


def _terms(
    pairs: Sequence[tuple[Array, Array]], setting: Setting, names: Sequence[tuple[str, str]]
) -> Array:
    """Sparse terms (2, candidates) of both axes."""
    theta, lacking = (np.concatenate(a) for a in zip(*pairs, strict=True))
    nominal = np.array([effect == NOMINAL for effect, _ in names])
    free = np.tile(nominal, theta.shape[1] // len(names))
    return beside(theta, lacking, free, setting).reshape(2, -1)


def discrepancy(ground: Ground) -> dict[str, dict[str, Any]]:
    """The textbook's form and the integral one: window and setting by information criterion."""
    model = Lumped.of(ground.machine.parameters)
    train = [Candidates(p, model) for p in ground.train]
    late = [Candidates(p, model) for p in ground.holdout]
    forms = {f"window {w:g} s": [differentiated(o, w) for o in train] for w in WINDOWS}
    return {
        "SINDy on acceleration": _best(forms, train, late),
        "SINDy, integral form": _best({"": [integral(o) for o in train]}, train, late),
    }


def _best(
    forms: dict[str, list[tuple[Array, Array]]], train: list[Candidates], late: list[Candidates]
) -> dict[str, Any]:
    tried, names = [], train[0].names
    count = sum(int(o.part.used.sum()) for o in train)
    for name, pairs in forms.items():
        for setting in SETTINGS:
            found = _terms(pairs, setting, names)
            score = criterion(left_by(found, train), count, found)
            tried.append((score, f"{name} {setting}".strip(), found))
    _, said, found = min(tried, key=lambda one: one[0])
    active = [n for n, c in zip(names, found.T, strict=True) if np.any(c)]
    return {
        "rms": left_by(found, late),
        "named": sorted({effect for effect, _ in active if effect != NOMINAL}),
        "terms": [term for _, term in active],
        "setting": said,
    }
