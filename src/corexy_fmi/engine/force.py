"""A named effect forced into the machine: what a wrong cause would have bought (a control)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import tuned_machine
from corexy_fmi.engine.judging.prove import prove
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.telling import document
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording


def force(
    train: Sequence[Recording],
    holdout: Sequence[Recording],
    machine: Machine,
    name: str,
    location: str,
) -> dict[str, Any]:
    """``heldout`` of CONTRACT 4 when this effect is fitted, whatever the data say."""
    layout = bundled_layout()
    runs, kept = make_runs(train, holdout, machine)
    base = retune(layout, machine, tuple(runs))
    lead = screen(base, [Hypothesis((layout.find(name, location),))])[0]
    fit = settle(min((minimise(lead.problem, s, 8) for s in lead.starts[:2]), key=lambda f: f.cost))
    machines = {
        "nominal": machine,
        "retuned": tuned_machine(base, machine.name),
        "explained": tuned_machine(fit, machine.name),
    }
    proof = prove(layout, machines, (*fit.problem.runs, *kept), fit.problem.runs, fit.problem.noise)
    return document.heldout(document.fit_rows(proof), weak=not holdout)
