"""Runs driven by step pulses: the ripple of a straight move, and a corner pulse by pulse."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from benchmarks.exact_stage import Array, ExactStage, matrices
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.motion import chain, command, line
from corexy_fmi.pulses import EDGE, Driver, staircase
from corexy_fmi.recording import Recording
from corexy_fmi.reproduce.measure import SETTLED
from corexy_fmi.reproduce.paths import WAYS as CORNERS
from corexy_fmi.reproduce.paths import Corner, full_step
from corexy_fmi.simulate import excitation, machine_vector

SETTLING, WATCHED = 0.8, 0.4  # [s] before the ripple is looked at, and while it is
ALONE = 1.0  # [s] after one pulse
ROW, STEP = 1e-3, 2e-5  # [s] between rows; longest micro-step, for pulses excite fast modes too
FREE = [0, 1, *range(4, 12)]
WAYS = {"x": (1.0, 0.0), "y": (0.0, 1.0)}


def modal_frequency(machine: Machine, axis: str) -> float:
    """Undamped frequency [Hz] of the slowest mode that moves an axis, motors held.

    Out of Lagrange's equations of (4) and (6), derived in `exact_stage`.
    """
    mass, stiffness, _, _ = matrices(machine.parameters)
    squares, shapes = eigh(stiffness[np.ix_(FREE, FREE)], np.diag(mass[FREE]))
    place = "xy".index(axis)
    mine = [n for n in range(len(FREE)) if abs(shapes[place, n]) > abs(shapes[1 - place, n])]
    return float(np.sqrt(squares[mine[0]]) / (2 * np.pi))


def resonance_speed(machine: Machine, axis: str, microsteps: int, harmonic: int = 1) -> float:
    """Speed [m/s] along an axis at which a harmonic of the pulses meets its mode.

    v = f r (1.8 degree) / (microsteps harmonic): along an axis both motors step at once.
    """
    travel = full_step(machine.parameters["pulley_radius"]) / microsteps
    return modal_frequency(machine, axis) * travel / harmonic


def ripple(machine: Machine, axis: str, speed: float, microsteps: int | None) -> float:
    """Peak to peak [m] of an axis about its steady motion at a speed [m/s]; None: no pulses."""
    order = straight(machine, axis, speed, microsteps)
    late = order.time > SETTLING
    return float(np.ptp(off_line(machine, axis, speed, order)[late]))


def straight(machine: Machine, axis: str, speed: float, microsteps: int | None) -> Recording:
    """A move along an axis, long enough for a ripple to settle; None: no pulses."""
    distance, way = speed * (SETTLING + WATCHED), np.array(WAYS[axis])
    start = -distance / 2 * way
    order = command(line(start.tolist(), (-start).tolist(), speed), _radius(machine), 1 / ROW)
    return order if microsteps is None else staircase(order, Driver(microsteps))


def off_line(machine: Machine, axis: str, speed: float, order: Recording) -> Array:
    """An axis less its commanded place (n,) [m]."""
    begin = -speed * (SETTLING + WATCHED) / 2
    return _run(machine, order)["xy".index(axis)] - (begin + speed * order.time)


def pulsed_corner(turn: str, interval: float, radius: float, microsteps: int, count: int) -> Corner:
    """A turn of so many pulses of both motors on each side, one every ``interval`` [s]."""
    step = full_step(radius) / microsteps
    first, second = (np.array(way) for way in CORNERS[turn])
    corner, end, speed = count * step * first, count * step * (first + second), step / interval
    motion = chain(line((0, 0), corner.tolist(), speed), line(corner.tolist(), end.tolist(), speed))
    made = staircase(command(motion, radius, 1 / ROW), Driver(microsteps))
    drive = Excitation(made.time, made["phi1"], made["phi2"])
    return Corner(turn, corner, drive, count * interval)


def settling(machine: Machine, axis: str, microsteps: int) -> float:
    """Time [s] from one pulse of both motors until an axis stays within 5 % of it; inf: never."""
    radius, way = _radius(machine), np.array(WAYS[axis])
    step = full_step(radius) / microsteps
    time = np.union1d(np.arange(0.0, ALONE, ROW / 4), [EDGE])
    x, y = np.outer(way, step * np.minimum(time / EDGE, 1.0))
    angles = {"phi1": (x + y) / radius, "phi2": (x - y) / radius}
    found = _run(machine, Recording("one pulse", time, angles))["xy".index(axis)]
    late = np.flatnonzero(np.abs(found - step) > SETTLED * step)
    return float(np.append(time, np.inf)[late[-1] + 1])


def by_jumps(machine: Machine, made: Recording) -> Array:
    """x, y (n, 2) [m] at the rows of a pulse train, exactly: angles jump where an edge begins."""
    angles = np.column_stack([made["phi1"], made["phi2"]])
    stage, path = ExactStage(machine.parameters, angles[0]), []
    for n, at in enumerate(angles):
        stage.state[-3:-1] = at
        path.append(stage.state[:2].copy())
        if n + 1 < len(angles):
            step = made.time[n + 1] - made.time[n]
            stage.advance(step if step > 2 * EDGE else 0.0)
    return np.array(path)


def at_corner(machine: Machine, corner: Corner) -> tuple[float, float]:
    """Eq. (17) and overshoot [m] of a machine at a corner."""
    vector = machine_vector(machine)[None]
    path = run_lanes(bundled_layout(), corner.excitation, vector, limit=STEP)[0].T
    return corner.error(path), corner.overshoot(path)


def _run(machine: Machine, order: Recording) -> Array:
    """x, y (2, n) [m]."""
    vector = machine_vector(machine)[None]
    return run_lanes(bundled_layout(), excitation(machine, order), vector, limit=STEP)[0]


def _radius(machine: Machine) -> float:
    return machine.parameters["pulley_radius"]
