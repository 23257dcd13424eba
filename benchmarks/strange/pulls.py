"""What belts, magnetic springs and imposed motors of `bodies.py` do.

- A section: pull A E e/l (1 + hardening |e|/2l) with the tangent A E/l (1 + hardening |e|/l); where
  l follows x and y by `strength`, these feel V = A E e^2/2l; not below -pretension.
- A Maxwell arm of `arm` k beside it; its dashpot is solved from mid-step to mid-step.
- A rotor: -holding sin(50 d) - damping d' - detent sin(200 phi + phase), d = phi - command.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.strange.beside import COGS, POLES
from benchmarks.strange.matrices import TIED


@njit(cache=True)
def stretch(q, of, e):  # type: ignore[no-untyped-def]
    """Of each section [m]; the run-out of an idler shows half of itself in both beside it."""
    which, runout, phase = of.runout.idler + 1, of.runout.amplitude, of.runout.phase
    off = runout / 2 * (np.sin(q[which] + phase) - np.sin(phase)) if runout > 0 else 0.0
    for s in range(12):
        e[s] = 0.0
        for t in range(TIED):
            k, tie = of.ties[s, t], of.table[s, t]
            e[s] += tie * q[k]
            if k == which and tie != 0:
                e[s] += off


@njit(cache=True)
def _pull(s, e, crept, length, of):  # type: ignore[no-untyped-def]
    """Of a section [N]."""
    stiffness = of.axial[s] / length
    pull = stiffness * e * (1 + of.hardening * abs(e) / length / 2)
    return max(pull, -of.pretension) + of.arm * stiffness * (e - crept)


@njit(cache=True)
def belts(q, e, crept, of, force):  # type: ignore[no-untyped-def]
    """What sections at their stretches do."""
    which, runout = of.runout.idler + 1, of.runout.amplitude
    more = runout / 2 * np.cos(q[which] + of.runout.phase) if runout > 0 else 0.0
    for s in range(12):
        length = of.lengths[s] + of.bends[0, s] * q[0] + of.bends[1, s] * q[1]
        pull = _pull(s, e[s], crept[s], length, of)
        for t in range(TIED):
            k, tie = of.ties[s, t], of.table[s, t]
            force[k] -= tie * pull
            if k == which and tie != 0:
                force[k] -= more * pull
        for a in range(2):
            force[a] += of.bends[a, s] * of.axial[s] * (e[s] / length) ** 2 / 2


@njit(cache=True)
def rotors(q, command, rate, of, force):  # type: ignore[no-untyped-def]
    """Magnetic springs, their damping, but for the rotors' speeds, and detents."""
    for a in range(2):
        force[2 + a] += of.magnet.damping * rate[a]
        force[2 + a] -= of.magnet.holding * np.sin(POLES * (q[2 + a] - command[a]))
        force[2 + a] -= of.magnet.detent * np.sin(COGS * q[2 + a] + of.magnet.phase)


@njit(cache=True)
def impose(q, v, command, rate, of):  # type: ignore[no-untyped-def]
    """Motors where no rotor is on a spring."""
    order, phase = of.ripple.order, of.ripple.phase
    for a in range(2):
        q[2 + a], v[2 + a], swing = command[a], rate[a], of.ripple.swings[a]
        if swing > 0:
            q[2 + a] += swing * (np.sin(order * command[a] + phase) - np.sin(phase))
            v[2 + a] += rate[a] * swing * order * np.cos(order * command[a] + phase)


@njit(cache=True)
def creep(crept, before, e, fades):  # type: ignore[no-untyped-def]
    """Dashpots of Maxwell arms follow the stretch."""
    for s in range(12):
        crept[s] += fades * ((before[s] + e[s]) / 2 - crept[s])
        before[s] = e[s]
