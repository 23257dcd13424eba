"""A stage drawn from a seed, from a pen plotter to a laser cutter; its modes; its machine file.

Numbers are true, by the simulator's symbols (`benchmarks/shop/stage.py`), in SI units; what the
machine file says is off by a log-normal factor of 10 to 15 %, but for the geometry and the gains
of a loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from benchmarks.shop.simulator import STEP
from benchmarks.shop.stage import CONTACT, LOOSE_INERTIA, YIN2018, Array, Faults, Numbers, stage

Random = np.random.Generator
FREE = [0, 1, *range(4, 12)]  # coordinates that no motor imposes
HZ_Y, HZ, STIFFNESS = (10.0, 70.0), (8.0, 90.0), (600.0, 20e3)  # mode of y, all modes; A E [N]
RATIO, DRY, GRAVITY = (0.03, 0.5), (0.1, 3.0), 9.81  # damping [1], dry friction [N], [m/s^2]
RANGES = {"r": (5e-3, 10e-3), "mx": (0.08, 1.5), "my": (0.15, 3.0), "mp": (3e-3, 20e-3),
          "W": (0.2, 0.8), "H": (0.2, 0.8), "c": (0.05, 0.12)}  # fmt: skip
DISC = (0.4, 1.0)  # inertia of a pulley over m_p r^2
INERTIA = (5e-8, 2e-6)  # of a pulley [kg m^2]
SHARES = (0.01, 0.2)  # of the idlers in all friction
HARD, LOOSE = 10.0, 0.05  # of a contact; drag of a loose pulley, in that of the carriage
REACHED = 0.35  # of W and H, to either side
RESOLVED = 0.5  # [rad] of the fastest pole in one step
GEOMETRY = {"r": "pulley_radius", "W": "bridge_pulley_spacing", "H": "motor_idler_span",
            "c": "clip_spacing"}  # fmt: skip
UNSURE = {"mx": "carriage_mass", "my": "bridge_mass", "mp": "pulley_mass", "Jp": "pulley_inertia",
          "AE": "belt_axial_stiffness", "bx": "carriage_viscous_friction",
          "by": "bridge_viscous_friction", "fx": "carriage_coulomb_friction",
          "fy": "bridge_coulomb_friction", "Bp": "pulley_viscous_friction",
          "tf": "pulley_coulomb_friction"}  # fmt: skip
MOTORS = {"J": "motor_inertia", "K1": "motor_torque_gain", "K2": "motor_damping_gain"}


class Modes(NamedTuple):
    """Of x and y: angular frequencies [rad/s], damping ratios; the fastest pole [rad/s]."""

    omega: Array
    damping: Array
    fastest: float


@dataclass(frozen=True)
class Machine:
    """True numbers, and how far a motion may go from the centre along x and y [m]."""

    numbers: Numbers
    modes: Modes
    half: tuple[float, float]

    @property
    def dc(self) -> bool:
        """Whether dc motors turn it, in a loop."""
        return "K1" in self.numbers

    def step(self, *, loose: bool) -> float:
        """A step that resolves the fastest pole [s], or an eighth where a loose pulley hits."""
        contact = np.sqrt(2 * self.numbers["contact"] / LOOSE_INERTIA) if loose else 0.0
        step = min(STEP, RESOLVED / max(self.modes.fastest, contact))
        return float(step / 8 if loose else step)


def spread(random: Random, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def modes(numbers: Numbers) -> Modes:
    """The two slow modes with the motors held, without dry friction."""
    of = stage(numbers, Faults())
    root = np.sqrt(of.mass[FREE])
    stretch = of.table[:, FREE] / root
    squares, shapes = np.linalg.eigh(stretch.T @ (of.stiffness[:, None] * stretch))
    order = np.argsort(-np.abs(shapes[0, :2]))  # that which moves x first
    omega = np.sqrt(squares[:2])[order]
    drags = of.viscous[0, FREE] / of.mass[FREE]
    damping = (shapes[:, :2] ** 2 * drags[:, None]).sum(0)[order] / (2 * omega)
    return Modes(omega, damping, float(np.sqrt(squares[-1])))


def _frictionless(random: Random) -> dict[str, float]:
    """Masses, sizes, and belts that put the mode of y where it is drawn."""
    n = {name: spread(random, *limits) for name, limits in RANGES.items()}
    inertia = n["mp"] * n["r"] ** 2 * random.uniform(*DISC)
    n |= {"Jp": float(np.clip(inertia, *INERTIA)), "AE": 1e3}
    n |= dict.fromkeys(("bx", "by", "fx", "fy", "Bp", "tf"), 0.0)
    asked = 2 * np.pi * spread(random, *HZ_Y)
    return n | {"AE": 1e3 * float(asked / modes(n).omega[1]) ** 2}


def _plausible(numbers: Numbers) -> bool:
    hertz = modes(numbers).omega / (2 * np.pi)
    belts = STIFFNESS[0] <= numbers["AE"] <= STIFFNESS[1]
    return bool(belts and HZ[0] <= hertz.min() and hertz.max() <= HZ[1])


def _viscous(random: Random, numbers: Numbers) -> dict[str, float]:
    """Guides and idlers that give both modes the damping that is drawn."""
    slow, asked = modes(numbers), np.array([spread(random, *RATIO) for _ in "xy"])
    guides = modes({**numbers, "bx": 1.0, "by": 1.0}).damping
    idlers = modes({**numbers, "Bp": 1.0}).damping - slow.damping
    drag = spread(random, *SHARES) * float((asked / idlers).min())
    rest = (asked - drag * idlers) / guides
    return {"Bp": drag, "bx": float(rest[0]), "by": float(rest[1])}


def _dry(random: Random, numbers: Numbers) -> dict[str, float]:
    """Coulomb friction of guides by the weight they carry, of idlers a share of that."""
    loads = numbers["mx"], numbers["mx"] + numbers["my"]
    fx, fy = (float(np.clip(m * GRAVITY * spread(random, 0.02, 0.15), *DRY)) for m in loads)
    share = spread(random, *SHARES)
    return {"fx": fx, "fy": fy, "tf": share * min(fx, fy) * numbers["r"] / 8}


def _contact(numbers: Numbers) -> float:
    """Of a loose pulley [N m/rad]: ten times as much stiffer than its belt as that of `yin2018` is,
    which gave way like a belt that is 2 % softer.
    """
    belts = [n["AE"] * n["r"] ** 2 / n["H"] for n in (numbers, YIN2018)]
    return HARD * CONTACT * max(belts[0] / belts[1], 1.0)


def draw_machine(random: Random) -> Machine:
    """A stage whose belts matter: its modes lie between 8 and 90 Hz."""
    numbers = _frictionless(random)
    while not _plausible(numbers):
        numbers = _frictionless(random)
    numbers |= _viscous(random, numbers)
    numbers |= _dry(random, numbers) | {"contact": _contact(numbers)}
    numbers["loose_drag"] = LOOSE * numbers["bx"] * numbers["r"] ** 2
    clear = 0.4 * (numbers["W"] - numbers["c"])  # the clips stay off the bridge's pulleys
    half = min(REACHED * numbers["W"], clear), REACHED * numbers["H"]
    return Machine(numbers, modes(numbers), half)


def machine_file(numbers: Mapping[str, float], random: Random) -> str:
    """The TOML that is handed over; priors are the defaults of bare numbers."""
    off, dc = random.uniform(0.10, 0.15), "K1" in numbers
    told = {long: numbers[name] for name, long in GEOMETRY.items()}
    told |= {
        long: numbers[name] * float(np.exp(off * random.standard_normal()))
        for name, long in (UNSURE | MOTORS if dc else UNSURE).items()
    }
    drive = "dc" if dc else "stepper"
    head = f'[machine]\nname = "strange"\ntopology = "corexy"\ndrive = "{drive}"\n'
    loop = "\n[controller]\nkp = {kp!r}\nkd = {kd!r}\n".format(**numbers) if dc else ""
    lines = [f"{name} = {value!r}\n" for name, value in told.items()]
    return f'{head}fidelity = "full"\n{loop}\n[parameters]\n{"".join(lines)}'
