"""Pulses begun again where a matched filter sees them, each recording's at its own place.

Their edges bend a fit's ground: one that begins with some of its pulses late ends with longer ones
that cover both.  At a known frequency every width and place is cheap to look at: the change that
pulses make there is regressed on what is left without them, off all that retuning can do.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.effects.api import TWO_PI
from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise
from corexy_fmi.engine.naming.pulses import EFFECT
from corexy_fmi.kernel.call import Array

DUTIES, PLACES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.85), 32  # widths, phases of each
TRIED, LONG = 3, 10  # widths that are fitted; iterations
BETTER = 1.0  # [nats] that one must gain to be taken


def matched(train: Fit, mapper: Mapper) -> Fit:
    """The better of a fit of pulses and itself begun again from the best widths, with the place of
    each recording's pulses and their size as a matched filter has them.
    """
    own = _own(train)
    quiet = train.u.copy()
    quiet[own["amplitude"]] = train.problem.unknowns[own["amplitude"]].internal(0.0)
    still, reach = train.problem.residual(quiet[None])[0], _reach(train, own)
    found = list(mapper(lambda duty: _seen(train, own, still, reach, duty), DUTIES))
    best = sorted(found, key=lambda seen: -seen[0])[:TRIED]
    again = mapper(lambda seen: minimise(train.problem, seen[1], LONG), best)
    ended = min([train, *again], key=lambda fit: fit.cost)
    return ended if ended.cost < train.cost - BETTER else train


def _own(train: Fit) -> dict[str, int]:
    """Where the unknowns of the pulses stand, by name."""
    heads = [f"{EFFECT}.{i.location}." for i in train.problem.hypothesis.uses]
    keys = enumerate(x.key for x in train.problem.unknowns)
    return {key.removeprefix(h): k for k, key in keys for h in heads if key.startswith(h)}


def _reach(train: Fit, own: dict[str, int]) -> list[Array]:
    """For each run, an orthonormal basis of what all but the pulses can do."""
    others = np.setdiff1d(np.arange(train.problem.size), list(own.values()))
    return [np.linalg.qr(train.jacobian[part][:, others])[0] for part in train.problem.parts]


def _seen(
    train: Fit, own: dict[str, int], still: Array, reach: list[Array], duty: float
) -> tuple[float, Array]:
    """What pulses of this width gain [nats], and where a fit of them begins."""
    problem, unknowns = train.problem, train.problem.unknowns
    phases = TWO_PI * (np.arange(PLACES) / PLACES - 0.5)
    rows = np.repeat(train.u[None], PLACES, axis=0)
    rows[:, own["duty"]] = unknowns[own["duty"]].internal(duty)
    places = {unknowns[k].run: k for name, k in own.items() if name.startswith("phase@")}
    for k in places.values():
        rows[:, k] = [unknowns[k].internal(phase) for phase in phases]
    change = problem.residual(rows)[:, : len(still)] - still
    start, pulls, power = rows[0].copy(), 0.0, 0.0
    for run, (part, q) in enumerate(zip(problem.parts, reach, strict=True)):
        moved = change[:, part] - (change[:, part] @ q) @ q.T
        along, size = -moved @ still[part], np.sum(moved**2, axis=1) + 1e-12
        best = int(np.argmax(np.where(along > 0, along**2 / size, 0.0)))
        start[places[run]], pulls = rows[best, places[run]], pulls + float(along[best])
        power += float(size[best])
    k = own["amplitude"]
    larger = max(pulls / power, 0.0) * float(unknowns[k].value(train.u[k]))
    start[k] = unknowns[k].internal(larger)
    return 0.5 * max(pulls, 0.0) ** 2 / power, start
