"""The mechanisms: how each is drawn, what is built, and the effect that it realises."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from plant.sensors import log_uniform

from benchmarks.mechanism.mjcf import Parts

GRAVITY = 9.81  # [m/s^2]
Draw = Callable[[np.random.Generator, Mapping[str, float]], "Realised"]


@dataclass(frozen=True)
class Realised:
    """A mechanism in the stage, and how the catalogue calls it: place and parameters there."""

    parts: Parts
    location: str
    parameters: dict[str, float]
    size: str  # in words


@dataclass(frozen=True)
class Mechanism:
    """``effect`` of the catalogue, what is built, the machines whose motion shows it, its draw."""

    effect: str
    built: str
    machines: tuple[str, ...]
    draw: Draw


ALL = ("yin2018", "light_bench", "gt2_printer")
SOFT = ALL[:2]  # whose belts give enough to show small forces


def tilt(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The whole stage leans: gravity pulls the carriage along x, or all that moves along y."""
    axis, sign = int(rng.integers(2)), float(rng.choice([-1.0, 1.0]))
    angle = log_uniform(rng, 3.0, 30.0)
    pull = sign * GRAVITY * float(np.sin(np.radians(angle)))
    moving = p["carriage_mass"] + axis * (p["bridge_mass"] + 4 * p["pulley_mass"])
    parts = Parts(tilt=(pull, 0.0) if axis == 0 else (0.0, pull))
    return Realised(parts, "xy"[axis], {"force": pull * moving}, f"{angle:.1f} degrees")


def play(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The belt pulley is loose on the rotor's shaft: a pin in a slot, with friction."""
    motor = int(rng.integers(1, 3))
    gap, hold = log_uniform(rng, 6e-3, 4e-2), log_uniform(rng, 5e-5, 5e-4)
    parts = Parts(loose=motor, gap=gap, hold=hold)
    numbers = {"gap": gap, "grip": 1e-5, "hold": hold}
    return Realised(parts, f"motor{motor}", numbers, f"{gap:.3g} rad, {hold:.2g} N m")


def yaw(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The bridge turns on its guides; the carriage's mass turns with it where it stands."""
    stiffness, inertia = log_uniform(rng, 30.0, 300.0), log_uniform(rng, 5e-4, 3e-3)
    ratio = float(rng.uniform(0.03, 0.15))
    numbers = {"stiffness": stiffness, "inertia": inertia, "damping_ratio": ratio}
    parts = Parts(yaw=(stiffness, inertia, ratio))
    return Realised(parts, "bridge", numbers, f"{stiffness:.3g} N m/rad")


def _mode(
    rng: np.random.Generator,
    mass: tuple[float, float],
    frequency: tuple[float, float],
    ratio: tuple[float, float],
) -> tuple[tuple[float, float, float], dict[str, float], str]:
    drawn = log_uniform(rng, *mass), log_uniform(rng, *frequency), float(rng.uniform(*ratio))
    numbers = dict(zip(("mass", "frequency", "damping_ratio"), drawn, strict=True))
    return drawn, numbers, f"{drawn[0]:.3g} kg, {drawn[1]:.3g} Hz"


def frame(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The frame is a mass on springs and carries all; the bridge rides on it along x too."""
    drawn, numbers, size = _mode(rng, (1.0, 8.0), (4.0, 25.0), (0.02, 0.1))
    return Realised(Parts(frame=drawn), "frame", numbers, size)


def tool(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The tool is a mass on springs; it is what is seen."""
    drawn, numbers, size = _mode(rng, (0.02, 0.15), (8.0, 50.0), (0.01, 0.05))
    return Realised(Parts(tool=drawn), "tool", numbers, size)


def mismatch(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The tendons of one belt are stiffer than those of the other."""
    ratio = log_uniform(rng, 0.1, 0.6) * float(rng.choice([-1.0, 1.0]))
    return Realised(Parts(ratio=ratio), "belts", {"ratio": ratio}, f"{ratio:+.2f}")


def damping(rng: np.random.Generator, p: Mapping[str, float]) -> Realised:
    """The tendons are damped."""
    time = log_uniform(rng, 5e-4, 4e-3)
    return Realised(Parts(damping_time=time), "belts", {"time": time}, f"{1e3 * time:.2g} ms")


MECHANISMS: dict[str, Mechanism] = {
    "tilt": Mechanism("constant_force", "gravity leans", SOFT, tilt),
    "play": Mechanism("backlash", "a pin on the rotor between two stops, by contact", ALL, play),
    "yaw": Mechanism("racking", "a hinge between bridge and guide", ("yin2018",), yaw),
    "frame": Mechanism("frame_mode", "the frame slides on springs under all", SOFT, frame),
    "tool": Mechanism("tool_mode", "a tool on springs on the carriage", ALL, tool),
    "tendons": Mechanism("belt_mismatch", "tendons of unequal stiffness", SOFT, mismatch),
    "dashpots": Mechanism("belt_damping", "tendons with damping", ("light_bench", "gt2_printer"),
                          damping),
}  # fmt: skip


def described(name: str, realised: Realised) -> dict[str, Any]:
    """The effect as a truth holds it."""
    return {
        "name": MECHANISMS[name].effect,
        "location": realised.location,
        "parameters": realised.parameters,
    }
