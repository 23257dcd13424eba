"""A Core-XY stage with steppers, written anew: nothing of the package or of the plant is in it.

Coordinates q = (x, y [m], phi_1 .. phi_10 [rad]), numbers of equations as in Yin et al. 2018:
pulleys 1 and 2 are the motors', 3 to 6 ride on the bridge, 7 to 10 are fixed idlers.

- (6) is a table: the stretch of each of the 12 belt sections, linear in q; force -dV/dq.
- (4) has a diagonal mass: m_x; M = m_y + m_x + 4 m_p; J_p of every idler.
- (7) acts on one coordinate each: -b v - f sgn v, set-valued at v = 0.  So a step of h [s] has a
  closed form and sticks exactly: half a drift of q; v* = (v (1 - a) + h Q/m) / (1 + a) with
  a = h b/2m; v is v* brought towards 0 by at most h f/m / (1 + a); half a drift.
  Breakaway friction is that at the step's mean speed: at its first one, stick and slip were off by
  12 um, and a diagnosis saw it.
- Motor angles are imposed and ramp from row to row.  A loose pulley (`Faults.play`) is a coordinate
  of its own, which the rotor turns where the play ends.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.shop.stage import Array, Faults, Numbers, Stage, at_rest, stage

STEP = 2.5e-5  # [s]: half of it changes x, y by 0.2 um at most; in play_tilt once by 2.4 um


def energy(q: Array, v: Array, of: Stage) -> Array:
    """(4) + (6) [J] of the states in rows; imposed pulleys have none of their own."""
    mass = np.where(np.isin(np.arange(12), (2, 3)), 0.0, of.mass)
    return ((q @ of.table.T) ** 2 @ of.stiffness + v**2 @ mass) / 2


def simulate(
    time: Array, phi: Array, numbers: Numbers, faults: Faults | None = None,
    step: float = STEP, begin: Array | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """q and its rate at every row; from rest at the first angles, or at ``begin``."""
    faults = faults or Faults()
    still, even = np.zeros((len(time), 2)), np.ones((len(time), 2))
    push = still if faults.push is None else faults.push
    grip = even if faults.grip is None else faults.grip
    first = at_rest(phi[0], numbers["r"]) if begin is None else begin
    count = max(1, int(np.ceil(np.median(np.diff(time)) / step)))
    return _run(time, np.ascontiguousarray(phi), push, grip, count, first, stage(numbers, faults))


@njit(cache=True)
def _at(rows, axis, where, reach):  # type: ignore[no-untyped-def]
    """A table over position, linear between its knots, constant beyond them."""
    last = rows.shape[1] - 1
    u = min(max((where + reach) / (2 * reach) * last, 0.0), last - 1e-3)
    i = int(u)
    return rows[axis, i] + (rows[axis, i + 1] - rows[axis, i]) * (u - i)


@njit(cache=True)
def _contact(twist, play, soft, stiffness):  # type: ignore[no-untyped-def]
    """Torque [N m] of a rotor that is ahead of its loose pulley by ``twist`` [rad]."""
    over, under = twist - play / 2, -twist - play / 2
    if soft > 0:
        ends = np.log1p(np.exp(min(over / soft, 50.0))) - np.log1p(np.exp(min(under / soft, 50.0)))
        return stiffness * soft * ends
    return stiffness * (max(over, 0.0) - max(under, 0.0))


@njit(cache=True)
def _forces(q, rotor, push, of, force):  # type: ignore[no-untyped-def]
    """Q: belts, what pulls at x and y, rotors at loose pulleys; all but friction."""
    force[:] = 0.0
    for s in range(12):
        tension = of.stiffness[s] * np.sum(of.table[s] * q)
        for j in range(12):
            force[j] -= of.table[s, j] * tension
    for a in range(2):
        force[a] += push[a] + _at(of.pull, a, q[a], of.reach)
        if of.play[a] >= 0:
            twist = rotor[a] - q[2 + a]
            force[2 + a] += _contact(twist, of.play[a], of.soft, of.contact)


@njit(cache=True)
def _kick(q, v, force, grip, h, of):  # type: ignore[no-untyped-def]
    """(7): the closed form of a step's new speed, of every coordinate that is not imposed."""
    for j in range(12):
        if (j == 2 or j == 3) and of.play[j - 2] < 0:
            continue
        drag = of.viscous[0 if v[j] >= 0 else 1, j]
        if j < 2:
            drag += of.windage[j] * abs(v[j])
        a = h * drag / (2 * of.mass[j])
        free = (v[j] * (1 - a) + h * force[j] / of.mass[j]) / (1 + a)
        after = v[j]
        for _ in range(2 if j < 2 and of.breakaway[j] != 1 else 1):  # level at the mean speed
            level = of.dry[0 if free > 0 else 1, j]
            if j < 2:
                slow = np.exp(-abs(v[j] + after) / 2 / of.fades)
                level *= grip[j] * (1 + (of.breakaway[j] - 1) * slow)
                level += _at(of.spot, j, q[j], of.reach)
            most = h * level / of.mass[j] / (1 + a)
            after = free - min(max(free, -most), most)
        v[j] = after


@njit(cache=True)
def _run(time, phi, push, grip, count, first, of):  # type: ignore[no-untyped-def]
    """``count`` steps from row to row."""
    rows, q, v, force = len(time), first.copy(), np.zeros(12), np.zeros(12)
    places, rates = np.zeros((rows, 12)), np.zeros((rows, 12))
    places[0] = q
    for i in range(1, rows):
        h = (time[i] - time[i - 1]) / count
        for a in range(2):
            if of.play[a] < 0:
                q[2 + a], v[2 + a] = phi[i - 1, a], (phi[i, a] - phi[i - 1, a]) / (count * h)
        for s in range(count):
            share = (s + 0.5) / count
            q += 0.5 * h * v
            rotor = phi[i - 1] + (phi[i] - phi[i - 1]) * share
            _forces(q, rotor, push[i - 1] + (push[i] - push[i - 1]) * share, of, force)
            _kick(q, v, force, grip[i - 1], h, of)
            q += 0.5 * h * v
        places[i], rates[i] = q, v
    return places, rates
