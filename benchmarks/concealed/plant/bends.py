"""Belt forces away from the paper's form, and laws that stand in no catalogue."""

import math

from numba import njit

from .layout import MEMORY, SLOT, STIFFNESS, YAW

R, AE, W, H, C = (
    SLOT[n]
    for n in (
        "pulley_radius",
        "belt_axial_stiffness",
        "bridge_pulley_spacing",
        "motor_idler_span",
        "clip_spacing",
    )
)
GAP, GAP_FORM, GAP_HOLD, MISMATCH = (SLOT[n] for n in ("gap1", "gap_form", "gap_hold", "mismatch"))
REAL, REAL_FORM, RUNOUT = SLOT["real_lengths"], SLOT["real_form"], SLOT["runout"]
RS, RP = SLOT["runout_size1"], SLOT["runout_phase1"]
TENSION, SLACK_FORM, HARD, HARD_FORM = (
    SLOT[n] for n in ("pretension", "slack_form", "hardening", "hardening_form")
)
TOOTH, TOOTH_PHASE, TEETH, TOOTH_FORM = (
    SLOT[n] for n in ("tooth1", "tooth_phase", "teeth", "tooth_form")
)
RACK = SLOT["rack_stiffness"]
ODD, SIZE, PLACE, WIDTH = (SLOT[n] for n in ("odd_kind", "odd_size", "odd_place", "odd_width"))


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
def section(w, k, drawn, real):
    """Stiffness and -dk/dl of a section that is `drawn` long at the centre and `real` here."""
    strength = w[REAL]
    if strength == 0.0:
        return k, 0.0
    if w[REAL_FORM] == 0.0:
        length = drawn + strength * (real - drawn)
        return k * drawn / length, strength * k * drawn / length**2
    return k * (1.0 - strength + strength * drawn / real), strength * k * drawn / real**2


@njit(cache=True)
def runout(w, i, phi):
    """Run-out of pulley i (1..10) and its slope over the angle; zero at phi = 0."""
    size, phase = w[RS + i - 1], w[RP + i - 1]
    if w[RUNOUT] == 0.0 or size == 0.0:
        return 0.0, 0.0
    return size * (math.sin(phi + phase) - math.sin(phase)), size * math.cos(phi + phase)


@njit(cache=True)
def tooth(w, i, phi):
    """Tooth error of driving pulley i (1, 2), and its slope: a sine, or one with an overtone."""
    size, n, phase = w[TOOTH + i - 1], w[TEETH], w[TOOTH_PHASE]
    if size == 0.0:
        return 0.0, 0.0
    more, angle = 0.3 * w[TOOTH_FORM], n * phi + phase
    out = math.sin(angle) - math.sin(phase) + more * (math.sin(2 * angle) - math.sin(2 * phase))
    return size * out, size * n * (math.cos(angle) + 2.0 * more * math.cos(2 * angle))


@njit(cache=True)
def tension(w, k, e):
    """Tension of a section over its pretension: hardening, and slack where it would push.

    Hardening: the stiffness for small changes is k (1 + c strain), or k exp(c strain). Slack: a
    sharp end of the tension, or a soft one (softplus).
    """
    strain, pull = k * e / w[AE], k * e
    if w[HARD] > 0.0:
        if w[HARD_FORM] == 0.0:
            pull *= max(1.0 + 0.5 * w[HARD] * strain, 0.2)
        else:
            pull = w[AE] / w[HARD] * (math.exp(min(w[HARD] * strain, 3.0)) - 1.0)
    if w[TENSION] > 0.0:
        left = pull + w[TENSION]
        soft = 0.1 * w[TENSION] * w[SLACK_FORM]
        if soft == 0.0:
            left = max(left, 0.0)
        elif left < 30.0 * soft:
            left = soft * math.log1p(math.exp(left / soft))
        return left - w[TENSION]
    return pull


@njit(cache=True)
def loose_pulley(w, phi, free, stiffness, memory, gap):
    """Angle of a driving pulley with play on its shaft.

    gap_form 0: it slips on the shaft where the belt's torque exceeds gap_hold, between two
    contacts; memory is its offset to the rotor. gap_form 1: play operator, the pulley stays
    where it was until a contact takes it along; memory is its angle.
    """
    if w[GAP_FORM] == 1.0:
        return min(max(memory, phi - 0.5 * gap), phi + 0.5 * gap)
    band = w[GAP_HOLD] / (w[R] * w[R] * stiffness)
    psi = min(max(phi + memory, free - band), free + band)
    return min(max(psi, phi - 0.5 * gap), phi + 0.5 * gap)


@njit(cache=True)
def belt(w, side, q, f):
    """Adds one belt's forces to region `f`; returns the angle of its driving pulley.

    side +1: belt 1 over 3, 1, 9, 8, 6; side -1: belt 2 over 4, 2, 10, 7, 5.
    """
    if side > 0:
        i3, i1, i9, i8, i6, k = 3, 1, 9, 8, 6, STIFFNESS
    else:
        i3, i1, i9, i8, i6, k = 4, 2, 10, 7, 5, STIFFNESS + 4
    r, x, y = w[R], side * w[q], w[q + 1]
    near, up = 0.5 * (w[W] - w[C]), 0.5 * w[H]
    k1, g1 = section(w, w[k], near, near + x)
    k2, g2 = section(w, w[k + 1], up, up + y)
    k5, g5 = section(w, w[k + 1], up, up - y)
    k6, g6 = section(w, w[k], near, near - x)
    k3, k4 = w[k + 2], w[k + 3]
    # belt travel at the pulleys, with the run-out u of each and its slope d
    t3, t9 = r * side * w[q + i3 + 1], r * side * w[q + i9 + 1]
    t8, t6 = r * side * w[q + i8 + 1], r * side * w[q + i6 + 1]
    u1, d1 = runout(w, i1, w[q + i1 + 1])
    u3, d3 = runout(w, i3, w[q + i3 + 1])
    u9, d9 = runout(w, i9, w[q + i9 + 1])
    u8, d8 = runout(w, i8, w[q + i8 + 1])
    u6, d6 = runout(w, i6, w[q + i6 + 1])
    psi, gap = w[q + i1 + 1], w[GAP + i1 - 1]
    if gap > 0.0:
        free = side * (k2 * (y - t3) + k3 * t9) / ((k2 + k3) * r)
        psi = loose_pulley(w, psi, free, k2 + k3, w[MEMORY + i1 - 1], gap)
    if w[TOOTH] + w[TOOTH + 1] > 0.0:
        more, slope = tooth(w, i1, w[q + i1 + 1])
        u1, d1 = u1 + more, d1 + slope
    t1 = side * (r * psi + u1)
    # tensions; yaw lowers the bridge pulley of section 2 and lifts that of section 5
    lift = 0.5 * side * w[W] * w[q + YAW]
    e1, e2, e3 = x + t3 + 0.5 * u3, y - t3 - t1 + 0.5 * u3, t1 - t9 + 0.5 * u9
    e4, e5, e6 = t9 - t8 + 0.5 * (u9 + u8), t8 - t6 - y + 0.5 * (u8 + u6), t6 - x + 0.5 * u6
    if w[RACK] > 0.0:
        e2, e5 = e2 - lift, e5 - lift
    f1, f2, f3, f4, f5, f6 = k1 * e1, k2 * e2, k3 * e3, k4 * e4, k5 * e5, k6 * e6
    if w[HARD] + w[TENSION] > 0.0:
        f1, f2, f3 = tension(w, k1, e1), tension(w, k2, e2), tension(w, k3, e3)
        f4, f5, f6 = tension(w, k4, e4), tension(w, k5, e5), tension(w, k6, e6)
    if w[RACK] > 0.0:
        w[f + YAW] += 0.5 * side * w[W] * (f2 + f5)
    w[f] += side * (f6 - f1 + 0.5 * (g1 * e1 * e1 - g6 * e6 * e6))
    w[f + 1] += f5 - f2 + 0.5 * (g2 * e2 * e2 - g5 * e5 * e5)
    w[f + i1 + 1] += side * (r + d1) * (f2 - f3)
    w[f + i3 + 1] += side * r * (f2 - f1) - 0.5 * d3 * (f1 + f2)
    w[f + i9 + 1] += side * r * (f3 - f4) - 0.5 * d9 * (f3 + f4)
    w[f + i8 + 1] += side * r * (f4 - f5) - 0.5 * d8 * (f4 + f5)
    w[f + i6 + 1] += side * r * (f5 - f6) - 0.5 * d6 * (f5 + f6)
    return psi


@njit(cache=True)
def odd_force(w, q, v, f):
    """Laws that stand in no catalogue; outside.py says what each one is."""
    kind, size = w[ODD], w[SIZE]
    if kind <= 2.0:
        axis = int(kind) - 1
        beyond = max(w[q + axis] - w[PLACE], 0.0)
        w[f + axis] -= size * beyond * beyond
    elif kind <= 4.0:
        axis = int(kind) - 3
        u = (w[q + axis] - w[PLACE]) / w[WIDTH]
        w[f + axis] += size * u * math.exp(0.5 - 0.5 * u * u)
    elif kind == 5.0:
        w[f] += size * w[v + 1]
    elif kind == 6.0:
        w[f + 1] += size * w[v]
