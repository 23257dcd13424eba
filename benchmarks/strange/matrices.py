"""A stage and what is beside it (`beside.py`) as matrices, for steps of a length."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.shop.simulator import STEP
from benchmarks.shop.stage import Array, Faults, Numbers, Stage, stage
from benchmarks.strange.beside import (
    COGS,
    COUNT,
    FRAME,
    POLES,
    TOOL,
    YAW,
    Beside,
    Magnet,
    Ripple,
    Runout,
)  # fmt: skip
from benchmarks.strange.machines import RESOLVED

TENSE = (1, -1, -1, 1, 1, 1, -1, 1, 1, -1, -1, -1)  # of (6), that a pull stretches a section
SIDES = {1: -0.5, 4: 0.5, 7: 0.5, 10: -0.5}  # of W: where sections end on the bridge
ALONG_X, ALONG_Y = (1, 0, 0, 0, 0, -1, -1, 0, 0, 0, 0, 1), (0, 1, 0, 0, -1, 0) * 2  # dl/dx, dl/dy
STRAINED, SHORTER = 5e-3, 4.0  # strain, stiffness more, for which a step is chosen
TIED = 4  # coordinates that stretch a section, at most
IMPOSED = Magnet(0.0, 0.0, 0.0)


class Linear(NamedTuple):
    """M q'' = -(springs q) - (drag q') - ..., sections' stretch by coordinate; no belts in these,
    but their dashpots in ``drag``.
    """

    table: Array
    mass: Array
    drag: Array
    springs: Array


def _hung(mass: Array, drag: Array, springs: Array, beside: Beside) -> None:
    """Frame and tool, each in x and y."""
    for a in range(2):
        for first, body, behind in ((FRAME, beside.frame, 1.0), (TOOL, beside.tool, 0.0)):
            if body:
                moves = mass[a, a] if behind else body.mass  # what goes along with both
                mass[a, first + a] = mass[first + a, a] = moves
                mass[first + a, first + a] = moves + behind * body.mass
                drag[first + a, first + a], springs[first + a] = body.drag, body.stiffness


def linear(of: Stage, numbers: Numbers, beside: Beside) -> Linear:
    """Matrices of a stage and what is beside it."""
    more = COUNT - 12
    table = np.pad(of.table * np.array(TENSE)[:, None], ((0, 0), (0, more)))
    mass, springs = np.diag([*of.mass, *[1.0] * more]), np.zeros(COUNT)
    drag = np.diag([*of.viscous[0], *[0.0] * more])
    _hung(mass, drag, springs, beside)
    if beside.magnet:
        mass[[2, 3], [2, 3]] = beside.magnet.inertia
        drag[[2, 3], [2, 3]] = beside.magnet.damping + numbers["Bp"]
    if beside.yaw:
        mass[YAW, YAW], drag[YAW, YAW] = beside.yaw.mass, beside.yaw.drag
        springs[YAW] = beside.yaw.stiffness
        ends = list(SIDES)
        table[ends, YAW] = table[ends, 1] * np.array(list(SIDES.values())) * numbers["W"]
    drag += beside.damping * table.T @ (of.stiffness[:, None] * table)
    return Linear(table, mass, drag, springs)


def step_of(numbers: Numbers, beside: Beside) -> float:
    """A step that resolves the fastest pole [s]."""
    of, free = stage(numbers, Faults()), beside.free
    table, mass, _, springs = linear(of, numbers, beside)
    most = (1 + SHORTER * beside.strength) * (1 + STRAINED * beside.hardening) * (1 + beside.arm)
    springs[:2] += beside.bristles
    if beside.magnet:
        springs[2:4] += POLES * beside.magnet.holding + COGS * abs(beside.magnet.detent)
    whole = np.diag(springs) + most * table.T @ (of.stiffness[:, None] * table)
    squares = np.linalg.eigvals(
        np.linalg.solve(mass[np.ix_(free, free)], whole[np.ix_(free, free)])
    )
    return float(min(STEP, RESOLVED / np.sqrt(squares.real.max())))


class Whole(NamedTuple):
    """As the compiled step reads it; matrices column by column, of each section the coordinates
    that stretch it and by how much.
    """

    on: Array
    gain: Array
    ties: NDArray[np.int64]
    table: Array
    axial: Array
    lengths: Array
    bends: Array
    springs: Array
    dry: Array
    hardening: float
    pretension: float
    arm: float
    relaxes: float
    bristles: Array
    loaded: Array
    ripple: Ripple
    runout: Runout
    magnet: Magnet


def whole(numbers: Numbers, beside: Beside, h: float) -> Whole:
    """A stage, and what is beside it, for steps of h [s]."""
    of, free = stage(numbers, Faults()), beside.free
    table, mass, drag, springs = linear(of, numbers, beside)
    gain, on = np.zeros((COUNT, COUNT)), np.eye(COUNT)
    gain[np.ix_(free, free)] = np.linalg.inv((mass / h + drag / 2)[np.ix_(free, free)])
    after = mass / h - drag / 2
    held = [j for j in range(COUNT) if j not in free]
    after[:, held] = -drag[:, held]  # both before and after
    on[free] = gain[free] @ after
    dry = np.array([*of.dry[0], *[0.0] * (COUNT - 12)])
    lengths = numbers["AE"] / of.stiffness
    shares = np.array([numbers["mx"] / of.mass[1], 1.0])  # of a pull across, that load the guide
    ties = np.argsort(table == 0, axis=1, kind="stable")[:, :TIED]
    belts = ties, np.take_along_axis(table, ties, 1), of.stiffness * lengths, lengths
    return Whole(
        on.T.copy(), gain.T.copy(), *belts, beside.strength * np.array([ALONG_X, ALONG_Y]),
        springs, dry, beside.hardening, beside.pretension, beside.arm, beside.relaxes,
        np.array(beside.bristles), shares * beside.loaded,
        beside.ripple, beside.runout, beside.magnet or IMPOSED,
    )  # fmt: skip
