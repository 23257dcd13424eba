"""What each suspected cause, forced into the model of flexdrive, would take from both outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.fit import Fit, minimise, settle
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import tuned_machine
from corexy_fmi.engine.judging.prove import prove
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.telling.document import fit_rows
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording

SUSPECTS = (
    ("constant_force", "x"),
    ("stribeck_friction", "xy"),
    ("presliding_hysteresis", "xy"),
    ("driver_deadband", "motors"),
)


def suspects(
    train: Sequence[Recording], holdout: Sequence[Recording], machine: Machine
) -> list[dict[str, Any]]:
    """Errors [m/s] of the retuned machine, and of it with each suspect, by role and channel."""
    layout = bundled_layout()
    runs, kept = make_runs(train, holdout, machine)
    base = retune(layout, machine, tuple(runs))
    found = [{"name": "", "location": "", "parameters": {}, "rms": _errors(base, kept)}]
    for name, location in SUSPECTS:
        lead = screen(base, [Hypothesis((layout.find(name, location),))])[0]
        fit = settle(minimise(lead.problem, lead.starts[0], 8))
        own = f"{name}.{location}."
        numbers = {
            u.key.removeprefix(own): float(fit.value(u.key))
            for u in fit.problem.unknowns
            if u.key.startswith(own)
        }
        found.append({"name": name, "location": location, "parameters": numbers,
                      "rms": _errors(fit, kept)})  # fmt: skip
    return found


def _errors(fit: Fit, kept: Sequence[Run]) -> dict[str, float]:
    """Root mean square [m/s] over all recordings of a role, by role and channel."""
    layout, runs = bundled_layout(), fit.problem.runs
    machines = {s: tuned_machine(fit, "fitted") for s in ("nominal", "retuned", "explained")}
    rows = fit_rows(prove(layout, machines, (*runs, *kept), runs, fit.problem.noise))
    pooled: dict[str, list[float]] = {}
    for row in rows:
        pooled.setdefault(f"{row['role']} {row['channel']}", []).append(row["rms_retuned"])
    return {key: float(np.sqrt(np.mean(np.square(v)))) for key, v in pooled.items()}
