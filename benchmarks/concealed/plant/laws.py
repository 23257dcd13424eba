"""Laws of guides, belts, motors and structure that the paper leaves out, after the first ten.

`form` numbers choose between functional forms of the literature; every law is nothing where its
size is zero. Rate-independent laws (bristles) are operators on the way since the last step,
with a memory that `settle` brings up; relaxing arms likewise, on the time since then.
"""

import math

from numba import njit

from .bends import straight_belts
from .layout import (
    ARMS,
    BRISTLES,
    EXTRA,
    FE,
    FRAME,
    LEVEL,
    MOBILITY,
    NOW,
    PUSH,
    QE,
    QS,
    SEEN,
    SLOT,
    VISCOUS,
    WOUND,
    ZENER,
    Q,
    V,
)

S = SLOT
SX, SV, SF = S["stribeck_x"], S["stribeck_speed"], S["stribeck_form"]
BRISTLE, BRISTLE_FORM = S["bristle_x"], S["bristle_form"]
SPOT, CENTER, WIDTH, SPOT_FORM = (S[f"spot_{n}"] for n in ("x", "center", "width", "form"))
LOAD, LOAD_FORM, DRAG, DRAG_FORM = S["load_x"], S["load_form"], S["drag_x"], S["drag_form"]
WARM, WARM_TIME, WARM_FORM = S["warm_x"], S["warm_time"], S["warm_form"]
ONSET, CABLE, CABLE_AT, CABLE_FORM = (
    S[n] for n in ("warm_onset", "cable_x", "cable_center", "cable_form")
)
BEAT, BEAT_RATE, BEAT_PHASE, DUTY = (
    S[n] for n in ("beat_x", "beat_frequency", "beat_phase", "beat_duty")
)
DAMPING, DAMPING_FORM, CREEP = S["damping_time"], S["damping_form"], S["creep_ratio"]
CREEP_TIME, CREEP_FORM = S["creep_time"], S["creep_form"]
DETENT, DETENT_PHASE, DETENT_ORDER = S["detent"], S["detent_phase"], S["detent_order"]
WINDING, WINDING_FORM, K2 = S["winding_time"], S["winding_form"], S["motor_damping_gain"]
RIPPLE, ORDER, RIPPLE_PHASE, RIPPLE_FORM = (
    S[n] for n in ("ripple", "ripple_order", "ripple_phase", "ripple_form")
)
DEAD, DEAD_FORM, SUPPLY, SUPPLY_FORM = (
    S[n] for n in ("deadband", "deadband_form", "supply", "supply_form")
)
FM, FK, FC = S["frame_mass"], S["frame_stiffness"], S["frame_damping"]
LAMINAR = 0.01  # speed below which the second drag law is linear in speed [m/s]
MICRO = 2e-4  # LuGre's damping of the bristles over their stiffness [s]
# Maxwell-slip elements: share of the friction; limit over that of one element of all stiffness
GIVES = ((0.1, 0.25), (0.2, 0.75), (0.3, 1.5), (0.4, 3.0))


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
        return w[LEVEL + i] * (1.0 + stribeck(w, w[SX + i], speed)) + w[EXTRA + i]
    return w[LEVEL + i]


@njit(cache=True)
def bristle(w, axis, k, place):
    """Share of its friction that element k of an axis holds when the guide is at `place`.

    Forms 0 and 1: Dahl's curve, exact for a way in one direction; 2: Maxwell slip.
    """
    memory = BRISTLES + 5 * axis
    way, held = place - w[memory], w[memory + 1 + k]
    bend = w[LEVEL + axis] / w[BRISTLE + axis]
    if w[BRISTLE_FORM] == 2.0:
        return min(max(held + way / (GIVES[k][1] * bend), -1.0), 1.0)
    end = 1.0 if way > 0.0 else -1.0
    return end + (held - end) * math.exp(-abs(way) / bend)


@njit(cache=True)
def bristle_force(w, axis, place, speed):
    """Friction before and in sliding; LuGre's has damped bristles."""
    if w[BRISTLE_FORM] == 2.0:
        share = 0.0
        for k in range(4):
            share += GIVES[k][0] * bristle(w, axis, k, place)
        return dry_level(w, axis, speed) * share
    share = bristle(w, axis, 0, place)
    out = dry_level(w, axis, speed) * share
    if w[BRISTLE_FORM] == 1.0:
        out += MICRO * w[BRISTLE + axis] * speed * (1.0 - math.copysign(share, speed * share))
    return out


@njit(cache=True)
def warmth(w, t):
    """Share of the extra friction of a cold start that is left at a time."""
    u = max(t - w[ONSET], 0.0) / w[WARM_TIME]
    if w[WARM_FORM] == 0.0:
        return math.exp(-u)
    return 0.6 * math.exp(-2.5 * u) + 0.4 * math.exp(-0.4 * u)


@njit(cache=True)
def extra_level(w, q, f, i, t):
    """Dry friction of a guide beyond Coulomb's and Stribeck's [N]."""
    out = 0.0
    if w[SPOT + i] > 0.0:
        u = abs(w[q + i] - w[CENTER]) / w[WIDTH]
        if w[SPOT_FORM] == 0.0:
            out += w[SPOT + i] * math.exp(-0.5 * u * u)
        elif u < 2.36:  # raised cosine of the same width at half its height
            out += 0.5 * w[SPOT + i] * (1.0 + math.cos(math.pi * u / 2.36))
    if w[LOAD + i] > 0.0:
        across = abs(w[f + 1 - i])
        load = across if w[LOAD_FORM] == 1.0 else math.hypot(across, w[f + i])
        out += w[LOAD + i] * load
    if w[WARM + i] > 0.0:
        out += w[LEVEL + i] * w[WARM + i] * warmth(w, t)
    return out


@njit(cache=True)
def beat(w, t):
    """Unit force in time: a sine, or pulses of the given duty with rounded edges."""
    angle = 2.0 * math.pi * w[BEAT_RATE] * t + w[BEAT_PHASE]
    if w[DUTY] == 0.0:
        return math.sin(angle)
    return 1.0 + math.tanh((math.sin(angle) - math.cos(math.pi * w[DUTY])) / 0.05)


@njit(cache=True)
def guide_forces(w, q, v, f, i, t):
    """Smooth forces on x or y."""
    place, speed, pull = w[q + i], w[v + i], 0.0
    if w[DRAG + i] > 0.0:
        low = LAMINAR if w[DRAG_FORM] == 1.0 else 0.0
        pull -= w[DRAG + i] * speed * (math.hypot(speed, low) - low)
    if w[CABLE + i] > 0.0:
        off = place - w[CABLE_AT]
        more = (off / 0.08) ** 2 if w[CABLE_FORM] == 1.0 else 0.0
        pull -= w[CABLE + i] * off * (1.0 + more)
    if w[WARM + i] > 0.0 and w[WARM_FORM] == 1.0:
        pull -= w[VISCOUS + i] * w[WARM + i] * warmth(w, t) * speed
    if w[BRISTLE + i] > 0.0:
        pull -= bristle_force(w, i, place, speed)
    if w[FM] > 0.0:  # the frame gives way: see `frame`
        lean = w[FK] * w[q + FRAME + i] + w[FC] * w[v + FRAME + i]
        w[f + i] += lean / (w[FM] * w[MOBILITY + i])
    w[f + i] += pull


@njit(cache=True)
def frame(w, q, v, a):
    """Accelerations of a frame on springs; the stage's coordinates are relative to it.

    m (a + b) = F and M b = -F - k u - c u': the stage moves as if it had the mobility
    1/m + 1/M and were pushed by (k u + c u') m/(m + M) too, which holds in sticking as well.
    """
    for i in range(2):
        lean = w[FK] * w[q + FRAME + i] + w[FC] * w[v + FRAME + i]
        share = 1.0 / (w[FM] * w[MOBILITY + i])
        w[a + FRAME + i] = -share * w[a + i] - (1.0 - share) * lean / w[FM]
        w[a + 12 + i] -= w[a + FRAME + i] if w[MOBILITY + 12 + i] > 0.0 else 0.0


@njit(cache=True)
def motor_torque(w, q, v, f, i):
    """What winding, cogging and commutation add to the torque on a rotor."""
    torque, back = w[PUSH + 2 + i], w[K2] * w[v + 2 + i]
    if w[WINDING] > 0.0:
        inside = back if w[WINDING_FORM] == 0.0 else 0.0
        w[f + WOUND + i] = torque - inside - w[v + WOUND + i]
        w[f + 2 + i] += w[v + WOUND + i] - torque + inside
        torque = w[v + WOUND + i]
    if w[RIPPLE] > 0.0:
        driven = torque - (back if w[RIPPLE_FORM] == 1.0 else 0.0)
        w[f + 2 + i] += driven * w[RIPPLE] * math.sin(w[ORDER] * w[q + 2 + i] + w[RIPPLE_PHASE])
    if w[DETENT] > 0.0:
        angle = w[DETENT_ORDER] * w[q + 2 + i] + w[DETENT_PHASE]
        w[f + 2 + i] -= w[DETENT] * math.sin(angle)


@njit(cache=True)
def limited(w, volts):
    """What a driver makes of the volts it is told."""
    if w[DEAD] > 0.0:
        if abs(volts) <= w[DEAD]:
            volts = 0.0
        elif w[DEAD_FORM] == 0.0:
            volts -= math.copysign(w[DEAD], volts)
    if w[SUPPLY] > 0.0:
        if w[SUPPLY_FORM] == 0.0:
            return min(max(volts, -w[SUPPLY]), w[SUPPLY])
        return volts / (1.0 + abs(volts / w[SUPPLY]) ** 8) ** 0.125
    return volts


@njit(cache=True)
def relaxed(here, speed, memory, fade, since):
    """Where a relaxing arm has come, from the middle of the way it was drawn along."""
    return memory + fade * (here - 0.5 * since * speed - memory)


@njit(cache=True)
def arm_times(w):
    """Relaxation times of the arms: two of creep, one of damping."""
    creep = max(w[CREEP_TIME], ZENER)
    if w[CREEP_FORM] == 0.0:
        return (creep, creep, ZENER)
    return (0.4 * creep, 2.5 * creep, ZENER)


@njit(cache=True)
def arms(w, q, v, f, ahead):
    """Forces of the belts' dashpots: the belts' own stiffness on what each arm still holds.

    Damping: Kelvin-Voigt, or Zener's arm that gives way in ZENER; creep: one arm, or two.
    """
    since, times = ahead - w[SEEN], arm_times(w)
    for i in range(12):
        drawn = w[DAMPING] * w[v + i] if w[DAMPING_FORM] == 0.0 else 0.0
        for k in range(3):
            size = 0.5 * w[CREEP] if k < 2 else w[DAMPING_FORM] * w[DAMPING] / ZENER
            if size > 0.0:
                fade = 1.0 - math.exp(-since / times[k])
                z = relaxed(w[q + i], w[v + i], w[ARMS + 12 * k + i], fade, since)
                drawn += size * (w[q + i] - z)
        w[QE + i] = drawn
    straight_belts(w, QE, FE)
    for i in range(12):
        w[f + i] += w[FE + i]


@njit(cache=True)
def beyond(w, q, v, f, ahead):
    """Everything here, added to the belts' forces `f`."""
    t = w[NOW] + ahead
    for i in range(2):
        w[EXTRA + i] = extra_level(w, q, f, i, t)
    if w[CREEP] + w[DAMPING] > 0.0:
        arms(w, q, v, f, ahead)
    push = beat(w, t)
    for i in range(2):
        guide_forces(w, q, v, f, i, t)
        motor_torque(w, q, v, f, i)
    for i in range(4):
        w[f + i] += w[BEAT + i] * push


@njit(cache=True)
def settle(w, since):
    """Brings all memories up to the state (Q, V), `since` seconds after the last time."""
    for axis in range(2):
        if w[BRISTLE + axis] > 0.0:
            memory = BRISTLES + 5 * axis
            for k in range(4):
                w[memory + 1 + k] = bristle(w, axis, k, w[Q + axis])
            w[memory] = w[Q + axis]
    if w[CREEP] + w[DAMPING] > 0.0:
        times = arm_times(w)
        for k in range(3):
            fade = 1.0 - math.exp(-since / times[k])
            for i in range(12):
                z = ARMS + 12 * k + i
                w[z] = relaxed(w[Q + i], w[V + i], w[z], fade, since)


@njit(cache=True)
def seat(w):
    """At rest: bristles bent so that they hold the belts' forces; arms have no force."""
    straight_belts(w, Q, QS)
    for axis in range(2):
        memory, level = BRISTLES + 5 * axis, max(w[LEVEL + axis], 1e-9)
        w[memory] = w[Q + axis]
        for k in range(4):
            w[memory + 1 + k] = min(max(w[QS + axis] / level, -0.95), 0.95)
    for i in range(12):
        for k in range(3):
            w[ARMS + 12 * k + i] = w[Q + i]
