"""Level L4 of concealment: the true entry is struck, and the free-form law must find its force.

A law only has to hold what retuning cannot: of the planted force and of the law, what viscous and
Coulomb friction, a spring and, where offsets are free, a constant force can take over is removed
before they are compared.  They are where the axis slides: a stuck one's force follows no law.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AXES = ("x", "y")
NOTHING = 0.05  # share of the planted force that retuning leaves, below which there is no curve
STEP = 1e-3  # [s] from row to row of the plant


def _motion(case: Any, name: str, speed: Array) -> dict[str, Array]:
    """What a law may depend on, from the noise-free truth and the recording (it may lack rows);
    ``free``: 1 where offsets are.
    """
    clean, rows = case.train_clean[name], len(speed)
    text = case.train[name].splitlines()
    head = next(n for n, line in enumerate(text) if not line.startswith("#"))
    names = text[head].split(",")
    given = np.genfromtxt(text[head + 1 :], delimiter=",")
    seen, time = given[:, names.index("time")], STEP * np.arange(rows)
    turned = [n for n in ("phi1", "phi2") if n in names]
    columns = {n: np.interp(time, seen, given[:, names.index(n)]) for n in turned}
    found = {"t": time, "x": clean["x"][:rows], "y": clean["y"][:rows]} | columns
    free = np.full(rows, float(not any(line.startswith("# zero:") for line in text[:head])))
    return found | {f"v{n}": speed[:, k] for k, n in enumerate(AXES)} | {"free": free}


def _left(force: Array, motion: dict[str, Array], axis: str) -> Array:
    """A force without what nominal parameters can take over."""
    speed, place = motion[f"v{axis}"], motion[axis]
    known = np.column_stack([motion["free"], speed, np.sign(speed), place])
    return force - known @ np.linalg.lstsq(known, force, rcond=None)[0]


def curve_error(case: Any, document: dict[str, Any]) -> float | None:
    """Rms of law minus planted force over that of the planted force; None where there is no law
    on the axis that was planted, or retuning holds all of that force.
    """
    law = next((e for e in document["effects"] if e["name"] == "free_form"), None)
    if case.planted_force is None or law is None or "knots" not in law:
        return None
    if law["location"] not in AXES:
        return None
    axis, off, size, whole = AXES.index(law["location"]), 0.0, 0.0, 0.0
    planted = (case.planted_force[k] for k in ("force", "speed", "slides"))
    for name, force, speed, slides in zip(sorted(case.train), *planted, strict=True):
        motion = _motion(case, name, speed)
        if law["argument"] not in motion:
            return None
        at = slides[:, axis]
        said = np.interp(motion[law["argument"]], law["knots"], law["values"])
        if law.get("acts") == "friction":
            said = -said * np.sign(speed[:, axis])
        both = [_left(f[at], {k: v[at] for k, v in motion.items()}, law["location"])
                for f in (said, force[:, axis])]  # fmt: skip
        off += float(np.sum((both[0] - both[1]) ** 2))
        size += float(np.sum(both[1] ** 2))
        whole += float(np.sum(force[at, axis] ** 2))
    return float(np.sqrt(off / size)) if size > NOTHING**2 * whole else None
