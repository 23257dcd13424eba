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
    """Rms of laws minus planted force over that of the planted force, along all axes that have a
    law; None where none is on an axis that was planted, or retuning holds all of that force.
    """
    told = [e for e in document["effects"] if e["name"] == "free_form" and "knots" in e]
    if case.planted_force is None or not told or any(e["location"] not in AXES for e in told):
        return None
    motions = [
        _motion(case, name, speed)
        for name, speed in zip(sorted(case.train), case.planted_force["speed"], strict=True)
    ]
    if any(law["argument"] not in motion for law in told for motion in motions):
        return None
    sums = sum(_squares(case, law, motions) for law in told)
    off, size, whole = np.asarray(sums)
    return float(np.sqrt(off / size)) if size > NOTHING**2 * whole else None


def _said(law: dict[str, Any], motion: dict[str, Array], name: str) -> Array:
    """The force of a law on the motion in a recording; onsets and what is viscous included."""
    told = {k: v["value"] for k, v in law.get("parameters", {}).items()}
    argument = motion[law["argument"]] - told.get(f"onset@{name}", 0.0)
    value = np.interp(argument, law["knots"], law["values"])
    if law.get("acts") != "friction":
        return np.asarray(value)
    speed = motion[f"v{law['location']}"]
    return np.asarray(-value * (np.sign(speed) + told.get("viscous", 0.0) * speed))


def _squares(case: Any, law: dict[str, Any], motions: list[dict[str, Array]]) -> Array:
    """Sums of squares (3,): law minus planted force, planted force, both as far as retuning cannot
    hold them, and all of that force.
    """
    axis, found = AXES.index(law["location"]), np.zeros(3)
    planted = (case.planted_force[k] for k in ("force", "slides"))
    names = sorted(case.train)
    for name, motion, force, slides in zip(names, motions, *planted, strict=True):
        at = slides[:, axis]
        said = _said(law, motion, name)
        here = {k: v[at] for k, v in motion.items()}
        own, true = (_left(f[at], here, law["location"]) for f in (said, force[:, axis]))
        squares = np.sum((own - true) ** 2), np.sum(true**2), np.sum(force[at, axis] ** 2)
        found += np.array(squares)
    return found
