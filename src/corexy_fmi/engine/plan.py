"""What could be named before anything is recorded: for every effect and place the smallest size,
and the program that shows it.

A size counts as nameable where the squared distance E that it puts between recording and retuned
machine pays for naming it, and where E_sep, what the nearest rival leaves of it, settles the name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.candidates import instances
from corexy_fmi.engine.experiment import SETTLES
from corexy_fmi.engine.fit import Fit, Mapper
from corexy_fmi.engine.foresee import Sensing, filled, imagined
from corexy_fmi.engine.name import THRESHOLD
from corexy_fmi.engine.noise import Noise
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.signature import changes, row_of
from corexy_fmi.engine.spread import Spread, combinations, groups, spread
from corexy_fmi.engine.unknowns import Hypothesis
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording

ROUNDS, CLOSE, NEAR = 16, 0.03, 0.3  # searches for a size; log of the share, aimed at and accepted
LEAST, STRIDE, FAREST, EDGE = 1e-3, 3.0, 12.0, 0.1  # share; on the scale of size; of a bracket
TRIED = 24  # starts of a rival that count


@dataclass(frozen=True)
class Nameable:
    """The smallest size of one effect that one program shows, and its nearest rival there.

    ``size`` is None where no size within the effect's bounds does.  ``others`` are the effect's
    other parameters at which it holds.
    """

    name: str
    location: str
    parameter: str
    size: float | None
    neutral: float
    unit: str
    program: str
    rival: str
    others: dict[str, float]


@dataclass(frozen=True, eq=False)
class _Stage:
    """One program: the bare machine on it, its reach q, where effects begin, and the subspaces
    (samples, n) into which every rival can move the samples.
    """

    program: str
    base: Fit
    q: Array
    offered: Spread
    rivals: dict[Instance, list[Array]]


def smallest(
    layout: Layout, machine: Machine, orders: dict[str, Recording], std: float, mapper: Mapper
) -> list[Nameable]:
    """The smallest nameable size of every effect and place, at its best program.

    ``orders`` are programs as phi1, phi2 by name; ``std`` [m] is the white noise of x and y.
    """
    jobs = [(layout, machine, name, order, std) for name, order in orders.items()]
    found: dict[tuple[str, str], Nameable] = {}
    for rows in mapper(_on_program, jobs):
        for row in rows:
            key = (row.name, row.location)
            if key not in found or _effort(layout, row) < _effort(layout, found[key]):
                found[key] = row
    return [found[key] for key in sorted(found)]


def _effort(layout: Layout, row: Nameable) -> float:
    """Distance from neutral on the scale on which larger is easier to see."""
    if row.size is None:
        return float("inf")
    size = layout.find(row.name, row.location).effect.size
    return 1 / row.size if size.scaling < 0 else abs(row.size - size.neutral)


def _on_program(job: tuple[Layout, Machine, str, Recording, float]) -> list[Nameable]:
    stage = _stage(*job)
    return [_smallest(stage, i) for i in stage.rivals]


def _stage(layout: Layout, machine: Machine, name: str, order: Recording, std: float) -> _Stage:
    white = Sensing({c: Noise(np.zeros(0), std, std) for c in ("x", "y")})
    run = imagined(order, machine, white)
    noise = (tuple(white.noise[s.channel] for s in run.samples),)
    still = Problem(layout, machine, (run,), noise)
    u = np.zeros(still.size)
    problem = replace(still, runs=(filled(run, still.simulate(u[None], 0)[0]),))
    residual, slopes = problem.linearised(u)
    base = Fit(problem, u, 0.0, residual, slopes)
    q, _ = np.linalg.qr(slopes)
    offered = spread(base)
    rivals = {i: _subspaces(base, i, q, offered) for i in instances(layout, machine)}
    return _Stage(name, base, q, offered, rivals)


def _subspaces(base: Fit, instance: Instance, q: Array, offered: Spread) -> list[Array]:
    """Orthonormal bases (samples, n) of what an effect can change; a wave's phases together."""
    rows = combinations(instance, offered)
    found = []
    for group in groups(instance, rows)[:TRIED]:
        shift = _shift(base, instance, [rows[n] for n in group], q)
        left, size, _ = np.linalg.svd(shift.T, full_matrices=False)
        found.append(left[:, size > max(1e-3 * size[0], 1e-9)])
    return found


def _shift(base: Fit, instance: Instance, rows: list[dict[str, float]], q: Array) -> Array:
    """What an effect at these values changes (sets, samples), off all that retuning can do."""
    problem = replace(base.problem, hypothesis=Hypothesis((instance,)))
    u = np.zeros(problem.size)
    return changes(base, problem, np.array([row_of(problem, u, instance, r) for r in rows]), q)


def _smallest(stage: _Stage, instance: Instance) -> Nameable:
    """The size at which the name would be settled on one program."""
    size, start = instance.effect.size, combinations(instance, stage.offered)[0]
    search, rival, values = _Search(), "", start
    for _ in range(ROUNDS):
        values = stronger(instance, start, search.place)
        share, rival = _share(stage, instance, values)
        if not search.goes_on(share):
            break
    least = search.share > 1 and values[size.name] in (
        size.lower,
        size.upper,
    )
    near = abs(np.log(max(search.share, LEAST))) < NEAR
    found = values[size.name] if near or least else None
    others = {n: v for n, v in values.items() if n != size.name}
    return Nameable(instance.effect.name, instance.location, size.name, found, size.neutral,
                    size.unit_at(instance.location), stage.program, rival, others)  # fmt: skip


@dataclass
class _Search:
    """Where on a logarithmic scale of size a share is 1: secants within what is bracketed."""

    place: float = 0.0
    share: float = 0.0
    below: tuple[float, float] | None = None  # place and logarithm of a share below 1, and above
    above: tuple[float, float] | None = None

    def goes_on(self, share: float) -> bool:
        """Take the share at this place and go to the next; False where it is near enough."""
        self.share, known = share, (self.place, float(np.log(max(share, LEAST))))
        if abs(known[1]) < CLOSE:
            return False
        self.below, self.above = (known, self.above) if known[1] < 0 else (self.below, known)
        if self.below is None or self.above is None:
            self.place -= float(np.clip(known[1], -STRIDE, STRIDE))
            return abs(self.place) < FAREST
        (a, low), (b, high) = self.below, self.above
        self.place = a + (b - a) * float(np.clip(low / (low - high), EDGE, 1 - EDGE))
        return True


def stronger(instance: Instance, start: dict[str, float], place: float) -> dict[str, float]:
    """Values at which an effect is exp(place) times as strong, as far as it is in proportion to its
    sizes, all of which move.
    """
    found = dict(start)
    for p in instance.effect.sizes:
        factor = float(np.exp(place * (p.scaling or 1)))
        away = (start[p.name] - p.neutral) * factor
        found[p.name] = start[p.name] * factor if p.log else p.neutral + away
        found[p.name] = min(max(found[p.name], p.lower), p.upper)
    return found


def _share(stage: _Stage, instance: Instance, values: dict[str, float]) -> tuple[float, str]:
    """What an effect shows over what naming it takes (as amplitudes), and its nearest rival."""
    drive = stage.base.problem.machine.drive
    change = _shift(stage.base, instance, [values], stage.q)[0]
    count = sum(drive in p.drives and not p.initial for p in instance.effect.parameters)
    needed = 2 * THRESHOLD + count * float(np.log(stage.base.problem.runs[0].count))
    rival, left = _nearest(stage, instance, change)
    return float(np.sqrt(min(float(change @ change) / needed, left / SETTLES))), rival


def _nearest(stage: _Stage, instance: Instance, change: Array) -> tuple[str, float]:
    """The rival that comes nearest to a change, and what it leaves of it (E_sep)."""
    power, best, name = float(change @ change), 0.0, "none"
    for other, subspaces in stage.rivals.items():
        near = max((float(np.sum((change @ s) ** 2)) for s in subspaces), default=0.0)
        if other != instance and near > best:
            best, name = near, f"{other.effect.name} at {other.location}"
    return name, max(power - best, 0.0)
