"""Forces of the 12-DoF stage, from Lagrange's equations with the energies (4), (6), (7).

A belt is a chain clip - bridge pulley - motor - idler - idler - bridge pulley - clip. With
`t` the belt travel at a pulley, its six stretches (positive: longer) are written once, for
belt 1; belt 2 is its mirror image: x -> -x, every angle -> -angle, y as it is.
`w` is the flat array of layout.py; `q`, `v`, `f`, `a` are the regions to work on.
"""

import math

from numba import njit

from .bends import belt, odd_force, straight_belts
from .laws import BRISTLE, FM, LOAD, SPOT, WARM, WINDING, beyond, dry_level, frame
from .layout import (
    BENDING,
    BENT_BELTS,
    BENT_DRY,
    BESIDE,
    BEYOND,
    DRIVEN,
    DRY,
    FREEDOM,
    IN_TIME,
    LEVEL,
    MOBILITY,
    MODE,
    MORE_FORCES,
    PAD,
    PUSH,
    RESTLESS,
    SLOT,
    SMOOTH_TURN,
    STIFFNESS,
    VISCOUS,
    WOUND,
    YAW,
)

S = SLOT
(R, MX, MY, MP, JP, JM, AE, W, H, C, B1, B2, F1, F2, BP, TF, K1, K2) = range(18)
DC, SMOOTH = S["dc"], S["smooth_speed"]
SX, SY = S["stribeck_x"], S["stribeck_y"]
GAP, MISMATCH, REAL, RUNOUT = S["gap1"], S["mismatch"], S["real_lengths"], S["runout"]
TH, TD = S["holding_torque"], S["magnetic_damping"]
TM, TK, TC = S["tool_mass"], S["tool_stiffness"], S["tool_damping"]
ODD = S["odd_kind"]
RACK, RACK_INERTIA, RACK_DAMPING = (S[f"rack_{n}"] for n in ("stiffness", "inertia", "damping"))
STEEPEST = 1e5  # fastest rate of a smoothed sgn on a pulley [1/s]


@njit(cache=True)
def bent_belts(w, q, f):
    """Elastic forces of both belts with the effects that change them."""
    for i in range(PAD):
        w[f + i] = 0.0
    belt(w, 1.0, q, f)
    belt(w, -1.0, q, f)
    w[f + YAW] -= w[RACK] * w[q + YAW]


@njit(cache=True)
def more_forces(w, q, v, f, ahead):
    """Forces that effects add beside the belts."""
    if w[BENT_BELTS] == 0.0:
        for i in range(12, PAD):
            w[f + i] = 0.0
    if w[BEYOND] != 0.0:
        beyond(w, q, v, f, ahead)
    for i in range(2):
        if w[TH] > 0.0:
            slope = w[DRIVEN + 2 + i]
            behind = w[q + i + 2] - w[DRIVEN + i] - slope * ahead
            w[f + i + 2] -= w[TH] * math.sin(50.0 * behind) + w[TD] * (w[v + i + 2] - slope)
        if w[TM] > 0.0:
            pull = w[TK] * (w[q + 12 + i] - w[q + i]) + w[TC] * (w[v + 12 + i] - w[v + i])
            w[f + i] += pull
            w[f + 12 + i] -= pull
    if w[ODD] > 0.0:
        odd_force(w, q, v, f)


@njit(cache=True)
def bent_friction(w, v, f, a):
    """Accelerations where dry friction depends on speed."""
    for i in range(2):
        bent = w[SX + i] + w[SPOT + i] + w[LOAD + i] + w[WARM + i] != 0.0
        if bent and w[SMOOTH] + w[BRISTLE + i] == 0.0:
            way = 1.0 if w[MODE + i] > 0.0 else -1.0
            dry = way * dry_level(w, i, max(way * w[v + i], 0.0))
            w[a + i] = (w[f + i] - dry) * w[FREEDOM + i]
    if w[SMOOTH] > 0.0:
        for i in range(12):
            if i < 2 and w[BRISTLE + i] > 0.0:
                continue
            scale = w[SMOOTH] if i < 2 else w[SMOOTH_TURN]
            dry = dry_level(w, i, w[v + i]) * math.tanh(w[v + i] / scale)
            w[a + i] = (w[f + i] - dry) * w[FREEDOM + i]


@njit(cache=True)
def accelerate(w, q, v, f, a, ahead):
    """Fills `f` (all forces but dry friction) and `a`; `ahead`: seconds since the row.

    DRY: signed dry friction of each sliding coordinate; FREEDOM: its 1 / inertia, 0 while it
    sticks or is driven; PUSH: forces that are constant within a row.
    """
    if w[BENT_BELTS] == 0.0:
        straight_belts(w, q, f)
    else:
        bent_belts(w, q, f)
    if w[MORE_FORCES] != 0.0:
        more_forces(w, q, v, f, ahead)
    for i in range(PAD):
        w[f + i] += w[PUSH + i] - w[VISCOUS + i] * w[v + i]
        w[a + i] = (w[f + i] - w[DRY + i]) * w[FREEDOM + i]
    if w[BENT_DRY] != 0.0:
        bent_friction(w, v, f, a)
    if w[FM] > 0.0:
        frame(w, q, v, a)


@njit(cache=True)
def acts(w, slots):
    """Whether a number is in any of these slots."""
    for slot in slots:
        if w[slot] != 0.0:
            return 1.0
    return 0.0


@njit(cache=True)
def derive(w):
    """Fills the constants behind the slots."""
    share = w[MISMATCH] / (2.0 + w[MISMATCH])
    lengths = (0.5 * (w[W] - w[C]), 0.5 * w[H], w[H], w[W])
    for i in range(4):
        w[STIFFNESS + i] = w[AE] * (1.0 + share) / lengths[i]
        w[STIFFNESS + 4 + i] = w[AE] * (1.0 - share) / lengths[i]
    motor = w[BP] + (w[K2] if w[DC] != 0.0 else 0.0)
    for i in range(2, 12):
        w[LEVEL + i] = w[TF]
        w[VISCOUS + i] = motor if i < 4 else w[BP]
        w[MOBILITY + i] = 1.0 / (w[JM] if i < 4 else w[JP])
    w[LEVEL], w[LEVEL + 1] = w[F1], w[F2]
    w[VISCOUS], w[VISCOUS + 1] = w[B1], w[B2]
    w[MOBILITY] = 1.0 / w[MX]
    w[MOBILITY + 1] = 1.0 / (w[MX] + w[MY] + 4.0 * w[MP])
    for i in range(12, 14):
        w[MOBILITY + i] = 1.0 / w[TM] if w[TM] > 0.0 else 0.0
    bent = w[GAP] + w[GAP + 1] + w[REAL] > 0.0 or w[RUNOUT] != 0.0
    w[BENT_BELTS] = 1.0 if bent else acts(w, BENDING)
    w[SMOOTH_TURN] = max(w[SMOOTH] / w[R], w[TF] / (min(w[JP], w[JM]) * STEEPEST))
    w[RESTLESS] = acts(w, IN_TIME)
    w[BEYOND] = max(w[RESTLESS], acts(w, BESIDE))
    w[MORE_FORCES] = 1.0 if w[TH] + w[TM] + w[ODD] > 0.0 else w[BEYOND]
    w[BENT_DRY] = 1.0 if w[SX] != 0.0 or w[SY] != 0.0 or w[SMOOTH] > 0.0 else 0.0
    for i in range(2):
        if w[FM] > 0.0:
            w[MOBILITY + i] += 1.0 / w[FM]
        if w[SPOT + i] + w[LOAD + i] + w[WARM + i] > 0.0:
            w[BENT_DRY] = 1.0
        if w[WINDING] > 0.0:
            w[FREEDOM + WOUND + i] = 1.0 / w[WINDING]
    if w[RACK] > 0.0:
        w[VISCOUS + YAW] = w[RACK_DAMPING]
        w[FREEDOM + YAW] = 1.0 / w[RACK_INERTIA]
