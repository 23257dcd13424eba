"""The stage of `benchmarks/shop/simulator.py` with what `beside.py` names, written anew.

A step of h [s]: half a drift of q; M (v+ - v)/h = Q - D (v+ + v)/2 - L; half a drift.  Q is what
belts and springs do at mid-step (`pulls.py`); D, of guides, pulleys, dashpots and bodies, is
constant, so that v+ = on v + gain (Q - L) with two matrices.  L, the dry friction, is set-valued,
|L_j| <= f_j on one coordinate each: found coordinate by coordinate from that of the step before;
where M and D are diagonal the first round is the closed form of the workshop's simulator.

- Bristles are a Maxwell-slip set: six springs that slip at f/6 each, the first of them soonest and
  the last at six times its way; together as stiff as is asked where none slips.
- Load: dry friction f + coefficient |pull| of belts across the guide, on the bridge all of it (its
  pulleys turn it), on the carriage its share of the mass that moves along y.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.shop.stage import Array, Numbers, at_rest
from benchmarks.strange.beside import COUNT, TOOL, YAW, Beside
from benchmarks.strange.matrices import whole
from benchmarks.strange.pulls import belts, creep, impose, rotors, stretch

ROUNDS, SAME = 60, 1e-9  # of friction at most; a change of it, over its bound
BRISTLES = 6
SHARES = sum(1 / (b + 1) for b in range(BRISTLES))  # their stiffness over that of the first


def simulate(
    time: Array, phi: Array, numbers: Numbers, beside: Beside, step: float,
    begin: Array | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """q and its rate at each of even times; from rest at the first angles, or at ``begin``."""
    row = float(time[-1] - time[0]) / (len(time) - 1)
    count = max(1, int(np.ceil(row / step)))
    first = np.pad(at_rest(phi[0], numbers["r"]), (0, COUNT - 12)) if begin is None else begin
    h = row / count
    return _run(np.ascontiguousarray(phi), h, count, first, whole(numbers, beside, h))


def reported(q: Array) -> Array:
    """x and y [m] of the tool on a bridge that yaws, where there are such: (n, 2)."""
    turned = np.column_stack([np.zeros(len(q)), q[:, YAW] * q[:, 0]])
    return q[:, :2] + turned + q[:, TOOL : TOOL + 2]


@njit(cache=True)
def _guides(q, seen, bent, of, force, most):  # type: ignore[no-untyped-def]
    """Most dry friction of each coordinate; bristles bend by what was moved, and have it all."""
    most[:] = of.dry
    across = abs(force[1]), abs(force[0])
    for a in range(2):
        most[a] += of.loaded[a] * across[a]
        moved, seen[a] = q[a] - seen[a], q[a]
        if of.bristles[a] > 0:
            soonest = most[a] / BRISTLES * SHARES / of.bristles[a]
            for b in range(BRISTLES):
                way = soonest * (b + 1)
                bent[a, b] = min(max(bent[a, b] + moved, -way), way)
                force[a] -= most[a] / BRISTLES * bent[a, b] / way
            most[a] = 0.0


@njit(cache=True)
def _rub(new, most, rubs, of):  # type: ignore[no-untyped-def]
    """Speeds and dry friction that go together."""
    for _ in range(ROUNDS):
        same = True
        for k in range(COUNT):
            own = of.gain[k, k]
            if own == 0 or (most[k] == 0 and rubs[k] == 0):
                continue
            change = min(max(rubs[k] + new[k] / own, -most[k]), most[k]) - rubs[k]
            rubs[k] += change
            same = same and abs(change) <= SAME * most[k]
            for i in range(COUNT if change != 0 else 0):
                new[i] -= of.gain[k, i] * change
        if same:
            break


@njit(cache=True)
def _kick(v, new, force, most, rubs, of):  # type: ignore[no-untyped-def]
    """A step's new speeds."""
    new[:] = 0.0
    for k in range(COUNT):
        speed, push = v[k], force[k] - rubs[k]
        for i in range(COUNT):
            new[i] += of.on[k, i] * speed + of.gain[k, i] * push
    _rub(new, most, rubs, of)
    v[:] = new


@njit(cache=True)
def _run(phi, h, count, first, of):  # type: ignore[no-untyped-def]
    """``count`` steps from row to row."""
    rows, q, v, new = len(phi), first.copy(), np.zeros(COUNT), np.zeros(COUNT)
    force, most, rubs, bent = (
        np.zeros(COUNT),
        np.zeros(COUNT),
        np.zeros(COUNT),
        np.zeros((2, BRISTLES)),
    )
    e, before, crept, seen = np.zeros(12), np.zeros(12), np.zeros(12), q[:2].copy()
    places, rates = np.zeros((rows, COUNT)), np.zeros((rows, COUNT))
    stretch(q, of, before)
    crept[:], places[0], fades = before, q, 1 - np.exp(-h / of.relaxes)
    for i in range(1, rows):
        rate, command = (phi[i] - phi[i - 1]) / (count * h), phi[i - 1].copy()
        for s in range(count):
            q += 0.5 * h * v
            for a in range(2):
                command[a] = phi[i - 1, a] + rate[a] * ((s + 0.5) * h)
            if of.magnet.holding == 0:
                impose(q, v, command, rate, of)
            stretch(q, of, e)
            creep(crept, before, e, fades)
            for k in range(COUNT):
                force[k] = -of.springs[k] * q[k]
            belts(q, e, crept, of, force)
            if of.magnet.holding > 0:
                rotors(q, command, rate, of, force)
            _guides(q, seen, bent, of, force, most)
            _kick(v, new, force, most, rubs, of)
            q += 0.5 * h * v
        places[i], rates[i] = q, v
    return places, rates
