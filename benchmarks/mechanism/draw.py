"""A case drawn from a seed: machine, motion, mechanism, noise; MuJoCo runs it.

Motions, true parameters (10 to 20 % off the file, one sigma, each) and noise are drawn by what the
concealed plant draws them with; nothing of its solver or its effects is used.

A constant load only moves the place where springs rest, so that no recording whose sensor has a
zero of its own can show it: tilted stages, and half of the nulls, are seen from the inputs' zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from plant.machines import base, draw_truth, machine_toml
from plant.motions import draw_motion
from plant.sensors import ar1, log_uniform
from plant.world import FILES, stream

from benchmarks.mechanism.mechanisms import ALL, MECHANISMS, Realised, described
from benchmarks.mechanism.mjcf import Parts
from benchmarks.mechanism.run import Array, mujoco_run

SECONDS = (5.0, 6.5)
SIGMA = (5e-6, 2e-5)  # [m]; what MuJoCo differs by from the kernel is below a tenth of it
LEAD, MOVED = 1000, 200  # rows before a recording begins, and those of them that move


@dataclass(frozen=True)
class Case:
    """Recordings (CSV text) and machine file as a user has them, and the sealed truth.

    By file: ``clean`` what the tip did (rows, 2) [m], ``moved`` the motor angles (LEAD + rows, 2)
    [rad]; ``values`` are the true parameters.
    """

    truth: dict[str, Any]
    machine_toml: str
    train: dict[str, str]
    holdout: dict[str, str]
    clean: dict[str, Array]
    moved: dict[str, Array]
    values: dict[str, float]
    parts: Parts


def lead_in(rng: np.random.Generator, phi: Array) -> Array:
    """The motion (rows, 2) [rad] with a small move before it: belts and play rest somewhere."""
    begin = phi[0] + rng.uniform(-0.2, 0.2, 2)
    share = np.minimum(np.arange(LEAD) / MOVED, 1.0)[:, None]
    return np.vstack([begin + share * (phi[0] - begin), phi])


def csv_text(phi: Array, seen: Array, zeroed: bool) -> str:
    """A recording at 1 kHz; ``zeroed``: the sensor's zero is that of the inputs."""
    rows = zip(np.arange(len(phi)).tolist(), phi.tolist(), seen.tolist(), strict=True)
    cells = (f"{k / 1000!r},{a!r},{b!r},{x!r},{y!r}" for k, (a, b), (x, y) in rows)
    return "# zero: x, y\n" * zeroed + "time,phi1,phi2,x,y\n" + "\n".join(cells) + "\n"


def tip(values: dict[str, float], moved: Array, parts: Parts) -> Array:
    """What the tip does (rows, 2) [m] from the first recorded row on."""
    return mujoco_run(values, moved, parts)[LEAD:]


def draw(
    seed: int,
    name: str | None,
    files: tuple[str, ...] = FILES,
    seconds: tuple[float, float] = SECONDS,
) -> Case:
    """The case of a mechanism, or of none, with some of its files; same arguments, same bytes."""
    rng = stream(seed, "mechanism")
    machines = MECHANISMS[name].machines if name else ALL
    machine = str(rng.choice(machines))
    values = draw_truth(rng, base(machine, "stepper"))
    realised = MECHANISMS[name].draw(rng, values) if name else Realised(Parts(), "", {}, "nothing")
    sigma, rho = log_uniform(rng, *SIGMA), float(rng.choice([0.0, rng.uniform(0.5, 0.9)]))
    zeroed = name == "tilt" or (name is None and rng.random() < 0.5)
    motions, texts, clean = {}, {}, {}
    for file in files:
        phi = draw_motion(rng, "commissioning", machine, values, rng.uniform(*seconds))
        motions[file] = lead_in(rng, phi)
        clean[file] = tip(values, motions[file], realised.parts)
        noise = sigma * np.column_stack([ar1(rng, len(phi), rho) for _ in "xy"])
        texts[file] = csv_text(phi, clean[file] + noise, zeroed)
    truth = {
        "kind": "effect" if name else "null",
        "mechanism": name,
        "size": realised.size,
        "effects": [described(name, realised)] if name else [],
        "E": None,
        "E_sep": None,
        "base": machine,
        "noise": {"sigma": sigma, "rho": rho},
        "zeroed": zeroed,
        "nominal": values,
        "seed": seed,
    }
    shown = (
        {n: t for n, t in texts.items() if (n in FILES[:2]) == train} for train in (True, False)
    )
    toml = machine_toml(base(machine, "stepper"), "stepper")
    return Case(truth, toml, *shown, clean, motions, values, realised.parts)
