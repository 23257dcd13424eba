"""The stage of `benchmarks/shop/simulator.py` turned by dc motors in a loop, written anew.

What is assumed beside what stands there:

- A rotor is a coordinate of its own: its inertia holds the driving pulley's, and B_p and tau_f of
  (7) act on it as on any pulley.  Its torque [N m] is tau = K_1 V - K_2 phi', positive along phi.
- A drive reads angle and speed of its rotor exactly, once a row, where it computes
  V = kp (ref - phi) + kd (ref' - phi'), ref' the slope of the reference from this row to the next,
  and holds V to the next row.  That V is recorded; what the bridge makes of it is not.
- A winding, L/R tau' = K_1 V - K_2 phi' - tau, is solved from mid-step to mid-step.
- A pulley with run-out e lets its belt feel r phi + e (sin(phi + p) - sin p); the rotor feels the
  work-conjugate of that, the pull times its derivative.
- A loose pulley is a coordinate that rubs as a pulley does, beside the rotor's own friction; its
  inertia is taken from the rotor's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from benchmarks.shop.simulator import _contact, _forces, _kick
from benchmarks.shop.stage import LOOSE_INERTIA, Array, Faults, Numbers, at_rest, stage

FOREVER = 1e9  # [V] of a supply without a limit


class Drive(NamedTuple):
    """What is wrong with both drives; by default nothing.  Half of a dead band [V] and the share of
    it that larger voltages lose, limit [V], L/R [s]; ripple over torque, ripples a turn, phase
    [rad]; of motor 1 and 2, half of the run-out over the radius, and its phase [rad].
    """

    dead: float = 0.0
    lost: float = 1.0
    limit: float = FOREVER
    lag: float = 0.0
    ripple: float = 0.0
    order: float = 0.0
    phase: float = 0.0
    runout: tuple[float, float] = (0.0, 0.0)
    turned: tuple[float, float] = (0.0, 0.0)


class Motor(NamedTuple):
    """Of each rotor: inertia, B_p, tau_f, K_1, K_2; gains of its loop.  SI units."""

    inertia: Array
    drag: float
    dry: float
    gain: float
    damping: float
    kp: float
    kd: float


class Ran(NamedTuple):
    """x and y [m], voltages [V] that the loop asks for, angles of rotors [rad]: a row each."""

    xy: Array
    volts: Array
    rotors: Array


def motor(numbers: Numbers, faults: Faults) -> Motor:
    """Two rotors in numbers."""
    n, loose = numbers, LOOSE_INERTIA * (np.array(faults.play) >= 0)
    return Motor(n["J"] - loose, n["Bp"], n["tf"], n["K1"], n["K2"], n["kp"], n["kd"])


def simulate(
    time: Array, ref: Array, numbers: Numbers, faults: Faults, wrong: Drive,
    step: float, every: int, offset: int,
) -> Ran:  # fmt: skip
    """From rest at the first references [rad]; the loop runs at every so many times, from
    ``offset`` on.
    """
    still, even = np.zeros((len(time), 2)), np.ones((len(time), 2))
    push = still if faults.push is None else faults.push
    grip = even if faults.grip is None else faults.grip
    count = max(1, int(np.ceil(np.median(np.diff(time)) / step)))
    slope = np.diff(ref, axis=0, append=ref[-1:]) / (time[1] - time[0])
    of, first = stage(numbers, faults), at_rest(ref[0], numbers["r"])
    given = of, motor(numbers, faults), wrong
    q, rotors, volts = _run(time, ref, slope, push, grip, count, every, offset, first, *given)
    return Ran(q[:, :2], volts, rotors)


@njit(cache=True)
def _bridge(asked, wrong):  # type: ignore[no-untyped-def]
    """The voltage that reaches a winding."""
    size = abs(asked)
    size = 0.0 if size < wrong.dead else size - wrong.lost * wrong.dead
    return np.sign(asked) * min(size, wrong.limit)


@njit(cache=True)
def _seat(q, phi, of, wrong):  # type: ignore[no-untyped-def]
    """Pulleys that are fast on their shafts: what their belts feel, over r [rad]."""
    for a in range(2):
        if of.play[a] < 0:
            off = np.sin(phi[a] + wrong.turned[a]) - np.sin(wrong.turned[a])
            q[2 + a] = phi[a] + wrong.runout[a] * off


@njit(cache=True)
def _load(a, q, phi, force, of, wrong):  # type: ignore[no-untyped-def]
    """Torque of a belt, or of a loose pulley, on its rotor [N m]."""
    if of.play[a] >= 0:
        return -_contact(phi[a] - q[2 + a], of.play[a], of.soft, of.contact)
    return force[2 + a] * (1 + wrong.runout[a] * np.cos(phi[a] + wrong.turned[a]))


@njit(cache=True)
def _turn(a, phi, w, load, wound, volts, h, motor, wrong):  # type: ignore[no-untyped-def]
    """A step's new speed of a rotor, as `_kick` has it; torque of its winding, where that lags."""
    ripple = 1 + wrong.ripple * np.sin(wrong.order * phi[a] + wrong.phase)
    if wrong.lag > 0:
        due = motor.gain * volts - motor.damping * w[a]
        wound[a] += (1 - np.exp(-h / wrong.lag)) * (due - wound[a])
        torque, drag = wound[a] * ripple, motor.drag
    else:
        torque, drag = motor.gain * volts * ripple, motor.drag + motor.damping * ripple
    b = h * drag / (2 * motor.inertia[a])
    free = (w[a] * (1 - b) + h * (torque + load) / motor.inertia[a]) / (1 + b)
    most = h * motor.dry / motor.inertia[a] / (1 + b)
    w[a] = free - min(max(free, -most), most)


@njit(cache=True)
def _run(time, ref, slope, push, grip, count, every, offset, first, of, motor, wrong):  # type: ignore[no-untyped-def]
    """``count`` steps from time to time; a winding, half a step behind, sees half of a change."""
    rows, q, v, force = len(time), first.copy(), np.zeros(12), np.zeros(12)
    phi, w, wound = first[2:4].copy(), np.zeros(2), np.zeros(2)
    asked, given = np.zeros(2), np.zeros(2)
    places, rotors, volts = np.zeros((rows, 12)), np.zeros((rows, 2)), np.zeros((rows, 2))
    for i in range(rows):
        before = given.copy()
        if i % every == offset:
            asked = motor.kp * (ref[i] - phi) + motor.kd * (slope[i] - w)
            given = np.array([_bridge(asked[0], wrong), _bridge(asked[1], wrong)])
        places[i], rotors[i], volts[i] = q, phi, asked
        h = (time[i + 1] - time[i]) / count if i + 1 < rows else 0.0
        for s in range(count if i + 1 < rows else 0):
            share = (s + 0.5) / count
            now = (before + given) / 2 if s == 0 and wrong.lag > 0 else given
            q += 0.5 * h * v
            phi += 0.5 * h * w
            _seat(q, phi, of, wrong)
            _forces(q, phi, push[i] + (push[i + 1] - push[i]) * share, of, force)
            _kick(q, v, force, grip[i], h, of)
            for a in range(2):
                _turn(a, phi, w, _load(a, q, phi, force, of, wrong), wound, now[a], h, motor, wrong)
            q += 0.5 * h * v
            phi += 0.5 * h * w
            _seat(q, phi, of, wrong)
    return places, rotors, volts
