"""How far MuJoCo and the kernel are apart: without a mechanism, and with each as its effect.

``python -m benchmarks.mechanism.agree`` prints and keeps it, seed by seed.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np
from plant.world import FILES

from benchmarks.concealed.blind import load
from benchmarks.mechanism.draw import LEAD, Case, draw, tip
from benchmarks.mechanism.mechanisms import MECHANISMS
from benchmarks.mechanism.mjcf import Parts
from benchmarks.mechanism.run import ROW, Array
from benchmarks.mechanism.store import keep, read
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, Machine
from corexy_fmi.simulate import machine_vector

FILE, SECONDS = FILES[0], (1.5, 2.0)


def kernel_tip(machine: Machine, moved: Array) -> Array:
    """x, y (rows, 2) [m] of the kernel at its own step, the lead-in left out."""
    layout, time = bundled_layout(), np.arange(len(moved)) * ROW
    drive = Excitation(time, *np.ascontiguousarray(moved.T))
    vector = machine_vector(machine, layout)[None]
    return run_lanes(layout, drive, vector)[0].T[LEAD:]


def apart(ours: Array, theirs: Array, zeroed: bool) -> dict[str, float]:
    """Their distance [um]; offsets are left out where the sensor may have one."""
    off = 1e6 * (theirs - ours)
    off -= 0.0 if zeroed else off.mean(axis=0)
    return {"rms": float(np.sqrt(np.mean(off**2))), "largest": float(np.abs(off).max())}


def true_machine(case: Case) -> Machine:
    """The kernel's machine with the true parameters and what realises the mechanism there."""
    machine = load(case)[2]
    uses = tuple(
        EffectUse(e["name"], e["location"], e["parameters"]) for e in case.truth["effects"]
    )
    return replace(machine, parameters={**machine.parameters, **case.values}, effects=uses)


def agreement(seed: int, name: str | None) -> dict[str, Any]:
    """Of one seed: what the mechanism does, and how much of that its effect leaves, unfitted."""
    case = draw(seed, name, (FILE,), SECONDS)
    machine, moved, theirs = true_machine(case), case.moved[FILE], case.clean[FILE]
    zeroed = case.truth["zeroed"]
    bare = kernel_tip(replace(machine, effects=()), moved)
    return {
        "mechanism": name or "none",
        "seed": seed,
        "machine": case.truth["base"],
        "size": case.truth["size"],
        "does": apart(tip(case.values, moved, Parts()), theirs, zeroed),
        "without": apart(bare, theirs, zeroed),
        "effect": apart(kernel_tip(machine, moved), theirs, zeroed),
    }


def main() -> None:
    """Print and keep the distances."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0])
    parser.add_argument("--mechanisms", nargs="*", default=["none", *MECHANISMS])
    arguments = parser.parse_args()
    for name in arguments.mechanisms:
        for seed in arguments.seeds:
            row = agreement(seed, None if name == "none" else name)
            kept = [r for r in read().get("agreement", []) if _key(r) != _key(row)]
            keep("agreement", sorted([*kept, row], key=_key))
            print(
                f"{row['mechanism']:10s} {row['machine']:12s} {row['size']:22s}"
                f" does {row['does']['rms']:7.2f}  kernel without {row['without']['rms']:7.2f}"
                f"  with its effect {row['effect']['rms']:6.3f} (largest"
                f" {row['effect']['largest']:.2f}) um",
                flush=True,
            )


def _key(row: dict[str, Any]) -> tuple[str, int]:
    return row["mechanism"], row["seed"]


if __name__ == "__main__":
    main()
