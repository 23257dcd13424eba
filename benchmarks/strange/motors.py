"""Dc motors drawn for a stage, and the gains of their loops; the poles of the whole.

A motor is drawn to suit what it moves, its loop stiff enough to follow, and kept where the whole,
linear and sampled, is well damped, and where a move as hard as any needs no more than 24 V.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.linalg import expm

from benchmarks.shop.stage import Array, Faults, Numbers, stage
from benchmarks.strange.machines import Machine, Random, spread
from benchmarks.strange.moves import limits

INERTIA, SUITS = (0.5e-5, 1e-4), (0.3, 2.0)  # of a rotor [kg m^2]; over what it moves of the stage
GAIN, EMF, DAMPING = (0.05, 0.3), (0.01, 0.08), (1e-3, 2e-2)  # K_1 [N m/V], K_2 / K_1, K_2
HZ, RATIO = (8.0, 30.0), (0.6, 1.2)  # of a motor with its load on a loop of its own
DAMPED, MOVES = 0.1, 0.5  # least damping [1] of poles with such a share of motion beside idlers
HELD = 0.7  # of the slowest decay, what sampling leaves at least
VOLTS, HARDER = 24.0, 1.5  # [V]; most over a steady move's
TRIES = 500
BEHIND = 4e-3  # [m] of a belt that a rotor may be behind


def _carried(n: Numbers) -> float:
    """Inertia of the stage that one motor moves [kg m^2]: (1) in (4)."""
    return float(n["r"] ** 2 * (2 * n["mx"] + n["my"] + 4 * n["mp"]) / 4)


def _system(n: Numbers) -> tuple[Array, Array]:
    """State matrix of places and rates without the loop and dry friction, input of both motors."""
    of = stage(n, Faults())
    mass, viscous = of.mass.copy(), of.viscous[0].copy()
    mass[2:4], viscous[2:4] = n["J"], n["Bp"] + n["K2"]
    a, b = np.zeros((24, 24)), np.zeros((24, 2))
    a[:12, 12:] = np.eye(12)
    a[12:, :12] = -(of.table.T @ (of.stiffness[:, None] * of.table)) / mass[:, None]
    a[12:, 12:] = -np.diag(viscous / mass)
    b[[14, 15], [0, 1]] = n["K1"] / n["J"]
    return a, b


def sampled(n: Numbers, row: float) -> tuple[Array, Array, Array]:
    """From row to row: of states, of held voltages; gains of the states in a voltage."""
    a, b = _system(n)
    whole = expm(row * np.block([[a, b], [np.zeros((2, 26))]]))
    gains = np.zeros((2, 24))
    gains[[0, 1], [2, 3]], gains[[0, 1], [14, 15]] = n["kp"], n["kd"]
    return whole[:24, :24], whole[:24, 24:], gains


def poles(n: Numbers) -> tuple[Array, Array]:
    """Of the whole, were the loop not sampled [rad/s], and of each the share of axes and rotors in
    the energy of its motion.
    """
    (a, b), gains = _system(n), sampled(n, 1e-3)[2]
    found, shapes = np.linalg.eig(a - b @ gains)
    mass = stage(n, Faults()).mass.copy()
    mass[2:4] = n["J"]
    energy = mass[:, None] * np.abs(shapes[12:]) ** 2
    return found, energy[:4].sum(0) / energy.sum(0)


def damped(n: Numbers, row: float) -> bool:
    """Whether axes and rotors are damped well, and sampling takes little of any decay."""
    found, share = poles(n)
    ratio = (-found.real / np.abs(found))[share > MOVES].min()
    a, b, gains = sampled(n, row)
    decays = -np.log(np.abs(np.linalg.eigvals(a - b @ gains))) / row
    return bool(ratio > DAMPED and decays.min() > HELD * (-found.real).min())


def _enough(n: Numbers, machine: Machine) -> bool:
    """Whether 24 V suffice for the fastest and hardest move, along a diagonal, and a rotor stays
    near its reference.
    """
    speed, hard = np.sqrt(2) * np.array(limits(machine)) / n["r"]
    drag = n["K2"] + n["Bp"] + (n["bx"] + n["by"]) * n["r"] ** 2 / 4
    dry = n["tf"] + (n["fx"] + n["fy"]) * n["r"] / 2
    torque = (n["J"] + _carried(n)) * hard + drag * speed + dry
    behind = n["r"] * (drag * speed + dry) / (n["K1"] * n["kp"])
    return bool(HARDER * torque < VOLTS * n["K1"] and behind < BEHIND)


def _motor(random: Random, numbers: Numbers) -> Mapping[str, float]:
    carried = _carried(numbers)
    inertia = float(np.clip(carried * spread(random, *SUITS), *INERTIA))
    gain = spread(random, *GAIN)
    damping = float(np.clip(gain * spread(random, *EMF), *DAMPING))
    omega, whole = 2 * np.pi * spread(random, *HZ), inertia + carried
    wanted = 2 * random.uniform(*RATIO) * omega * whole
    loop = {"kp": whole * omega**2 / gain, "kd": max(wanted - damping, 0.2 * wanted) / gain}
    told = {name: float(f"{value:.3g}") for name, value in loop.items()}  # as somebody types them
    return {"J": inertia, "K1": gain, "K2": damping, **told}


def with_motors(random: Random, machine: Machine, row: float) -> Machine | None:
    """The stage with dc motors whose loops run once a row [s]; None where none suits it."""
    for _ in range(TRIES):
        numbers = {**machine.numbers, **_motor(random, machine.numbers)}
        if _enough(numbers, machine) and damped(numbers, row):
            fastest = max(float(np.abs(poles(numbers)[0]).max()), machine.modes.fastest)
            return replace(machine, numbers=numbers, modes=machine.modes._replace(fastest=fastest))
    return None
