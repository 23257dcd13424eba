"""Forces of the 12-DoF stage, from Lagrange's equations with the energies (4), (6), (7).

A belt is a chain clip - bridge pulley - motor - idler - idler - bridge pulley - clip. With
`t` the belt travel at a pulley, its six stretches (positive: longer) are written once, for
belt 1; belt 2 is its mirror image: x -> -x, every angle -> -angle, y as it is.
`w` is the flat array of layout.py; `q`, `v`, `f`, `a` are the regions to work on.
"""

import math

from numba import njit

from .bends import belt, odd_force
from .layout import (
    BENT_BELTS,
    BENT_DRY,
    DRIVEN,
    DRY,
    FREEDOM,
    LEVEL,
    MOBILITY,
    MORE_FORCES,
    N_COORD,
    PAD,
    PUSH,
    SLOT,
    SMOOTH_TURN,
    STIFFNESS,
    VISCOUS,
)

S = SLOT
(R, MX, MY, MP, JP, JM, AE, W, H, C, B1, B2, F1, F2, BP, TF, K1, K2) = range(18)
DC, SMOOTH = S["dc"], S["smooth_speed"]
SX, SY, SV, SF = S["stribeck_x"], S["stribeck_y"], S["stribeck_speed"], S["stribeck_form"]
GAP, MISMATCH, REAL, RUNOUT = S["gap1"], S["mismatch"], S["real_lengths"], S["runout"]
TH, TD = S["holding_torque"], S["magnetic_damping"]
TM, TK, TC = S["tool_mass"], S["tool_stiffness"], S["tool_damping"]
ODD = S["odd_kind"]
STEEPEST = 1e5  # fastest rate of a smoothed sgn on a pulley [1/s]


@njit(cache=True)
def straight_belts(w, q, f):
    """Elastic forces of both belts in the paper's own form, (6)."""
    r, x, y, k = w[R], w[q], w[q + 1], STIFFNESS
    t1, t3, t9, t8, t6 = w[q + 2], w[q + 4], w[q + 10], w[q + 9], w[q + 7]
    f1, f2 = w[k] * (x + r * t3), w[k + 1] * (y - r * (t3 + t1))
    f3, f4 = w[k + 2] * r * (t1 - t9), w[k + 3] * r * (t9 - t8)
    f5, f6 = w[k + 1] * (r * (t8 - t6) - y), w[k] * (r * t6 - x)
    t1, t3, t9, t8, t6 = w[q + 3], w[q + 5], w[q + 11], w[q + 8], w[q + 6]
    g1, g2 = -w[k + 4] * (x + r * t3), w[k + 5] * (y + r * (t3 + t1))
    g3, g4 = w[k + 6] * r * (t9 - t1), w[k + 7] * r * (t8 - t9)
    g5, g6 = w[k + 5] * (r * (t6 - t8) - y), w[k + 4] * (x - r * t6)
    w[f], w[f + 1] = f6 - f1 + g1 - g6, f5 - f2 + g5 - g2
    w[f + 2], w[f + 3] = r * (f2 - f3), r * (g3 - g2)
    w[f + 4], w[f + 5] = r * (f2 - f1), r * (g1 - g2)
    w[f + 10], w[f + 11] = r * (f3 - f4), r * (g4 - g3)
    w[f + 9], w[f + 8] = r * (f4 - f5), r * (g5 - g4)
    w[f + 7], w[f + 6] = r * (f5 - f6), r * (g6 - g5)


@njit(cache=True)
def stribeck(w, extra, speed):
    """Extra friction over Coulomb's, as a share: exponential, Lorentzian or Gaussian fall."""
    if extra == 0.0:
        return 0.0
    u = abs(speed) / w[SV]
    if w[SF] == 0.0:
        return extra * math.exp(-u)
    if w[SF] == 1.0:
        return extra / (1.0 + u * u)
    return extra * math.exp(-u * u)


@njit(cache=True)
def dry_level(w, i, speed):
    """Size of the dry friction on coordinate i; at speed 0 what breaks it loose."""
    if i < 2:
        return w[LEVEL + i] * (1.0 + stribeck(w, w[SX + i], speed))
    return w[LEVEL + i]


@njit(cache=True)
def bent_belts(w, q, f):
    """Elastic forces of both belts with the effects that change them."""
    for i in range(N_COORD):
        w[f + i] = 0.0
    belt(w, 1.0, q, f)
    belt(w, -1.0, q, f)


@njit(cache=True)
def more_forces(w, q, v, f, ahead):
    """Forces that effects add beside the belts."""
    w[f + 12] = w[f + 13] = 0.0
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
        if w[SX + i] != 0.0 and w[SMOOTH] == 0.0:
            way = 1.0 if w[DRY + i] > 0.0 else -1.0
            dry = way * dry_level(w, i, max(way * w[v + i], 0.0))
            w[a + i] = (w[f + i] - dry) * w[FREEDOM + i]
    if w[SMOOTH] > 0.0:
        for i in range(12):
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
    w[BENT_BELTS] = 1.0 if bent else 0.0
    w[SMOOTH_TURN] = max(w[SMOOTH] / w[R], w[TF] / (min(w[JP], w[JM]) * STEEPEST))
    w[MORE_FORCES] = 1.0 if w[TH] + w[TM] + w[ODD] > 0.0 else 0.0
    w[BENT_DRY] = 1.0 if w[SX] != 0.0 or w[SY] != 0.0 or w[SMOOTH] > 0.0 else 0.0
