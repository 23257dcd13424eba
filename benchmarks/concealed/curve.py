"""Level L4 of concealment: the true entry is struck, and the free-form law must find its force.

A law only has to hold what retuning cannot: of the planted force and of the law, what viscous and
Coulomb friction, a spring and a constant force can take over is removed before they are compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AXES = ("x", "y")
STILL = 1e-4  # [m/s] below which a sign means nothing
STEP = 1e-3  # [s] from row to row of the plant


def _motion(case: Any, name: str, rows: int) -> dict[str, Array]:
    """What a law may depend on, from the noise-free truth and the recording (it may lack rows)."""
    clean = case.train_clean[name]
    text = case.train[name].splitlines()
    head = next(n for n, line in enumerate(text) if not line.startswith("#"))
    names = text[head].split(",")
    given = np.genfromtxt(text[head + 1 :], delimiter=",")
    seen, time = given[:, names.index("time")], STEP * np.arange(rows)
    turned = [n for n in ("phi1", "phi2") if n in names]
    columns = {n: np.interp(time, seen, given[:, names.index(n)]) for n in turned}
    found = {"t": time, "x": clean["x"][:rows], "y": clean["y"][:rows]} | columns
    return found | {f"v{n}": np.gradient(found[n], time) for n in AXES}


def _left(force: Array, motion: dict[str, Array], axis: str) -> Array:
    """A force without what nominal parameters can take over."""
    speed, place = motion[f"v{axis}"], motion[axis]
    sign = np.where(np.abs(speed) > STILL, np.sign(speed), 0.0)
    known = np.column_stack([np.ones(len(force)), speed, sign, place])
    return force - known @ np.linalg.lstsq(known, force, rcond=None)[0]


def curve_error(case: Any, document: dict[str, Any]) -> float | None:
    """Rms of law minus planted force over that of the planted force; None where there is no law
    on the axis that was planted.
    """
    law = next((e for e in document["effects"] if e["name"] == "free_form"), None)
    if case.planted_force is None or law is None or "knots" not in law:
        return None
    if law["location"] not in AXES:
        return None
    axis, off, size = AXES.index(law["location"]), 0.0, 0.0
    for name, force in zip(sorted(case.train), case.planted_force["force"], strict=True):
        motion = _motion(case, name, len(force))
        if law["argument"] not in motion:
            return None
        moving = np.abs(motion[f"v{law['location']}"]) > STILL
        said = np.interp(motion[law["argument"]], law["knots"], law["values"])
        both = [_left(f[moving], {k: v[moving] for k, v in motion.items()}, law["location"])
                for f in (said, force[:, axis])]  # fmt: skip
        off += float(np.sum((both[0] - both[1]) ** 2))
        size += float(np.sum(both[1] ** 2))
    return float(np.sqrt(off / size)) if size > 0 else None
