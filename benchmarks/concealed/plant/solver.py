"""RK4 between events: every stick, release and reversal of dry friction is located.

Between two events each friction force has a fixed sign, so the right-hand side is smooth
and RK4 keeps its order. A trial step that ends behind an event is cut at the event.
"""

import numpy as np
from numba import njit

from .bends import belt
from .kernel import DC, GAP, K1, SMOOTH, TH, TM, accelerate
from .laws import BRISTLE, DEAD, SUPPLY, dry_level, limited, seat, settle
from .layout import (
    A1,
    AA,
    AB,
    AC,
    BEYOND,
    DRIVEN,
    DRY,
    F1,
    FREE,
    FREEDOM,
    IMPOSED,
    MEMORY,
    MOBILITY,
    MODE,
    N_COORD,
    NOW,
    PAD,
    PUSH,
    Q1,
    QS,
    RESTLESS,
    SEEN,
    SLOT,
    V1,
    VA,
    VB,
    VC,
    WOUND,
    A,
    F,
    Q,
    V,
)

KP, KD, GAP_FORM = SLOT["kp"], SLOT["kd"], SLOT["gap_form"]
FORCE_X = SLOT["force_x"]
MAX_EVENTS, SHORTEST = 40, 1e-9
SHOWN = WOUND + 2  # coordinates that are shown


@njit(cache=True)
def rk4(w, h, ahead):
    """One step from (Q, V) with acceleration A to (Q1, V1), and F1, A1 there."""
    for i in range(PAD):
        w[QS + i] = w[Q + i] + 0.5 * h * w[V + i]
        w[VA + i] = w[V + i] + 0.5 * h * w[A + i]
    accelerate(w, QS, VA, F1, AA, ahead + 0.5 * h)
    for i in range(PAD):
        w[QS + i] = w[Q + i] + 0.5 * h * w[VA + i]
        w[VB + i] = w[V + i] + 0.5 * h * w[AA + i]
    accelerate(w, QS, VB, F1, AB, ahead + 0.5 * h)
    for i in range(PAD):
        w[QS + i] = w[Q + i] + h * w[VB + i]
        w[VC + i] = w[V + i] + h * w[AB + i]
    accelerate(w, QS, VC, F1, AC, ahead + h)
    for i in range(PAD):
        speeds = w[V + i] + 2.0 * (w[VA + i] + w[VB + i]) + w[VC + i]
        w[Q1 + i] = w[Q + i] + h / 6.0 * speeds
        rates = w[A + i] + 2.0 * (w[AA + i] + w[AB + i]) + w[AC + i]
        w[V1 + i] = w[V + i] + h / 6.0 * rates
    accelerate(w, Q1, V1, F1, A1, ahead + h)


@njit(cache=True)
def first_event(w):
    """Earliest share of the step at which a coordinate stops or breaks loose, and which one."""
    first, which = 2.0, -1
    for i in range(N_COORD):
        mode, share = w[MODE + i], 2.0
        if mode * mode == 1.0 and w[V1 + i] * mode < 0.0:
            share = w[V + i] / (w[V + i] - w[V1 + i]) if w[V + i] * mode > 0.0 else 0.0
        elif mode == 0.0:
            after, level = w[F1 + i], dry_level(w, i, 0.0)
            if abs(after) > level:
                before = min(w[F + i] if after > 0.0 else -w[F + i], level)
                share = (level - before) / (abs(after) - before)
        if share < first:
            first, which = share, i
    return first, which


@njit(cache=True)
def set_mode(w, i, mode):
    w[MODE + i] = mode
    w[DRY + i] = mode * dry_level(w, i, 0.0) if mode * mode == 1.0 else 0.0
    w[FREEDOM + i] = 0.0 if mode == 0 or mode == IMPOSED else w[MOBILITY + i]


@njit(cache=True)
def switch(w, i):
    """The coordinate stops or breaks loose at this instant: stick, or slide with the force."""
    mode = 1 if w[F + i] > 0.0 else -1
    if w[MODE + i] != 0.0 and abs(w[F + i]) <= dry_level(w, i, 0.0) * (1.0 + 1e-9):
        mode = 0
    set_mode(w, i, mode)
    w[V + i] = 0.0
    w[A + i] = (w[F + i] - w[DRY + i]) * w[FREEDOM + i]


@njit(cache=True)
def remember(w):
    """Moves the driving pulleys' memory along (backlash)."""
    for i in range(2):
        if w[GAP + i] > 0.0:
            psi = belt(w, 1.0 - 2.0 * i, Q, QS)
            w[MEMORY + i] = psi if w[GAP_FORM] == 1.0 else psi - w[Q + 2 + i]


@njit(cache=True)
def advance(w, h, ahead):
    """One step of length h, cut at events; Q, V, F, A end consistent."""
    left, events = h, 0
    w[SEEN] = ahead
    while left > SHORTEST:
        rk4(w, left, ahead)
        share, which = first_event(w)
        events += 1
        if share > 1.0 or events > MAX_EVENTS:
            share = 1.0
        elif share * left > SHORTEST:
            rk4(w, share * left, ahead)
        if share * left > SHORTEST:
            for i in range(4 * PAD):
                w[Q + i] = w[Q1 + i]
            ahead += share * left
            left -= share * left
            remember(w)
            if w[BEYOND] != 0.0:
                settle(w, ahead - w[SEEN])
                w[SEEN] = ahead
        if which >= 0:
            switch(w, which)


@njit(cache=True)
def start(w, q0, memory0):
    """Everything rests; what has no dry friction is free."""
    for i in range(N_COORD):
        mode = FREE if w[SMOOTH] > 0.0 or i >= 12 else 0
        if (2 <= i < 4 and w[DC] + w[TH] == 0.0) or (i >= 12 and w[TM] == 0.0):
            mode = IMPOSED
        if i < 2 and w[BRISTLE + i] > 0.0:
            mode = FREE
        set_mode(w, i, mode)
        w[Q + i], w[V + i] = q0[i], 0.0
    w[MEMORY], w[MEMORY + 1] = memory0[0], memory0[1]
    remember(w)
    seat(w)


@njit(cache=True)
def apply_row(w, angle, slope, outer):
    """Inputs of a row: drives the motors; returns the volts of the PD loop."""
    volts = (0.0, 0.0)
    for i in range(2):
        w[DRIVEN + i], w[DRIVEN + 2 + i] = angle[i], slope[i]
        w[PUSH + i] = outer[i] + w[FORCE_X + i]
        if w[MODE + 2 + i] == IMPOSED:
            w[Q + 2 + i], w[V + 2 + i] = angle[i], slope[i]
    if w[DC] != 0.0:
        one = w[KP] * (angle[0] - w[Q + 2]) + w[KD] * (slope[0] - w[V + 2])
        two = w[KP] * (angle[1] - w[Q + 3]) + w[KD] * (slope[1] - w[V + 3])
        w[PUSH + 2], w[PUSH + 3] = w[K1] * one, w[K1] * two
        volts = (one, two)
        if w[DEAD] + w[SUPPLY] > 0.0:
            w[PUSH + 2], w[PUSH + 3] = w[K1] * limited(w, one), w[K1] * limited(w, two)
    return volts


@njit(cache=True)
def at_rest(w):
    """Nothing moves, nothing can within this row, and nothing breaks loose."""
    if w[DRIVEN + 2] != 0.0 or w[DRIVEN + 3] != 0.0 or w[RESTLESS] != 0.0:
        return False
    for i in range(N_COORD):
        if w[V + i] != 0.0 or w[FREEDOM + i] != 0.0:
            return False
        if w[MODE + i] == 0.0 and abs(w[F + i]) > dry_level(w, i, 0.0):
            return False
    return True


@njit(cache=True, nogil=True)
def simulate(machine, step, ref, outer, q0, memory0, substeps):
    """Positions, speeds, modes, (memory, volts) at every row of the angles `ref`."""
    rows, w, h = ref.shape[0], machine.copy(), step / substeps
    qs, vs = np.empty((rows, SHOWN)), np.empty((rows, SHOWN))
    modes, rest = np.empty((rows, N_COORD)), np.zeros((rows, 4))
    start(w, q0, memory0)
    for n in range(rows):
        after = min(n + 1, rows - 1)
        rest[n, 2:] = apply_row(w, ref[n], (ref[after] - ref[n]) / step, outer[n])
        for i in range(SHOWN):
            qs[n, i], vs[n, i] = w[Q + i], w[V + i]
        for i in range(N_COORD):
            modes[n, i] = w[MODE + i]
        rest[n, 0], rest[n, 1] = w[MEMORY], w[MEMORY + 1]
        w[NOW], w[SEEN] = n * step, 0.0
        accelerate(w, Q, V, F, A, 0.0)
        if n + 1 == rows or at_rest(w):
            continue
        for k in range(substeps):
            advance(w, h, k * h)
    return qs, vs, modes, rest
