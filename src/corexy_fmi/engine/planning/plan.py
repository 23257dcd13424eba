"""What could be named before anything is recorded: for every effect and place the smallest size,
and the program that shows it.

A size counts as nameable where a recording names it as often as not: where the squared distance E
that it puts between recording and retuned machine pays for naming it, and E_sep, what the nearest
rival leaves of it, settles the name.  Linear signatures choose the program; there the machine and
the nearest rivals are fitted (`plan_fit.py`), for both can do more than their signatures say.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.verdict import SURE
from corexy_fmi.engine.naming.abreast import alone
from corexy_fmi.engine.naming.beyond import Beyond, beyond
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.entries import TEMPERATURE, THRESHOLD
from corexy_fmi.engine.naming.plan_size import Nameable, Sized, sized, stronger
from corexy_fmi.engine.naming.signature import changes, row_of
from corexy_fmi.engine.naming.spread import Spread, combinations, groups, spread
from corexy_fmi.engine.planning.foresee import Sensing, filled, imagined
from corexy_fmi.engine.planning.plan_fit import Rivalry, cost_of
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording

TRIED, LIKE = 24, 0.2  # starts of a rival that count; share of E that makes it one
FAINT = 0.1  # of the size at which a fit begins
PROGRAMS = 2  # on which fits are tried, at most
SETTLED = 2 * TEMPERATURE * float(np.log(SURE / (1 - SURE)))  # E_sep at which the name is sure


@dataclass(frozen=True, eq=False)
class _Stage:
    """One program: the bare machine on it and its reach, where effects begin, and the subspaces
    (samples, n) into which every rival can move the samples.
    """

    program: str
    behind: Beyond
    offered: Spread
    rivals: dict[Instance, list[Array]]


def smallest(
    layout: Layout, machine: Machine, orders: dict[str, Recording], std: float, mapper: Mapper
) -> list[Nameable]:
    """The smallest nameable size of every effect and place, at its best program.

    ``orders`` are programs as phi1, phi2 by name; ``std`` [m] is the white noise of x and y.
    ``mapper`` is called twice: with the programs, and with the effects at their places.
    """
    jobs = [(layout, machine, name, order, std) for name, order in orders.items()]
    found: dict[tuple[str, str], list[Sized]] = {}
    for one in (one for rows in mapper(_on_program, jobs) for one in rows):
        found.setdefault((one.row.name, one.row.location), []).append(one)
    bases = {name: bare(machine, layout, order, std) for name, order in orders.items()}
    order = {key: sorted(found[key], key=lambda o: (_effort(o), -o.share)) for key in sorted(found)}
    ranked = [(bases, programs) for programs in order.values()]
    return list(mapper(_best, ranked))


def _effort(one: Sized) -> float:
    """Distance from neutral on the scale on which larger is easier to see."""
    if one.row.size is None:
        return float("inf")
    size = one.instance.effect.size
    return 1 / one.row.size if size.scaling < 0 else abs(one.row.size - size.neutral)


def _on_program(job: tuple[Layout, Machine, str, Recording, float]) -> list[Sized]:
    layout, machine, name, order, std = job
    base = bare(machine, layout, order, std)
    behind, offered = beyond(base), spread(base)
    rivals = {i: _subspaces(behind, i, offered) for i in instances(layout, machine)}
    stage = _Stage(name, behind, offered, rivals)
    return [_linear(stage, i) for i in rivals]


def bare(machine: Machine, layout: Layout, order: Recording, std: float) -> Fit:
    """The bare machine, fitted to what it shows of a program without noise."""
    white = Sensing({c: Noise(np.zeros(0), std, std) for c in ("x", "y")})
    run = imagined(order, machine, white)
    noise = (tuple(white.noise[s.channel] for s in run.samples),)
    still = Problem(layout, machine, (run,), noise=noise)
    u = np.zeros(still.size)
    problem = replace(still, runs=(filled(run, still.simulate(u[None], 0)[0]),))
    residual, slopes = problem.linearised(u)
    return Fit(problem, u, problem.log_scale(), residual, slopes)


def _subspaces(behind: Beyond, instance: Instance, offered: Spread) -> list[Array]:
    """Orthonormal bases (samples, n) of what an effect can change: a wave's phases together, and
    each of several sizes alone.
    """
    rows = combinations(instance, offered)
    found = []
    for group in [[rows[n] for n in g] for g in groups(instance, rows)[:TRIED]] + _edges(instance):
        apart = [_alone(instance, row, p) for row in group for p in instance.effect.sizes]
        shift = _shift(behind, instance, apart)
        left, size, _ = np.linalg.svd(shift.T, full_matrices=False)
        found.append(left[:, size > max(1e-3 * size[0], 1e-9)])
    return found


def _alone(instance: Instance, row: dict[str, float], size: Parameter) -> dict[str, float]:
    """A row with one of its sizes, the others neutral; small, for a large one's signature bends."""
    faint = row if size.over else stronger(instance, row, float(np.log(FAINT)))
    return faint | {p.name: p.neutral for p in instance.effect.sizes if p != size}


def _edges(instance: Instance) -> list[list[dict[str, float]]]:
    """Rows with each time constant, width or count at either bound: where a rival may be fitted."""
    first = {p.name: p.starts[0] for p in instance.effect.parameters}
    free = [p for p in instance.effect.parameters if p.log and not (p.size or p.over or p.shape)]
    return [[first | {p.name: value}] for p in free for value in (p.lower, p.upper)]


def _shift(behind: Beyond, instance: Instance, rows: list[dict[str, float]]) -> Array:
    """What an effect at these values changes (sets, samples), off all that retuning can do."""
    problem = replace(behind.fit.problem, hypothesis=Hypothesis((instance,)))
    u = np.zeros(problem.size)
    vectors = np.array([row_of(problem, u, instance, r) for r in rows])
    return behind.off(alone(changes(behind.fit, problem, vectors)))


def _linear(stage: _Stage, instance: Instance) -> Sized:
    """The size at which linear signatures say that the name would be settled on one program."""

    def share(values: dict[str, float]) -> tuple[float, list[Instance]]:
        change = _shift(stage.behind, instance, [values])[0]
        rivals, left = _nearest(stage, instance, change)
        return visible(stage.behind.fit, instance, float(change @ change), left), rivals

    start = combinations(instance, stage.offered)[0]
    return sized(instance, start, stage.program, share)


def _best(job: tuple[dict[str, Fit], list[Sized]]) -> Nameable:
    """The smallest fitted size, of the programs that signatures put first: it ends where the next
    one's signature, which fits hardly ever better, promises no more.  What is a rival on one is
    tried on each.
    """
    bases, ranked = job
    rivals = tuple(dict.fromkeys(i for one in ranked[:PROGRAMS] for i in one.rivals))
    best = None
    for one in ranked[:PROGRAMS]:
        if best is not None and best.row.size is not None and _effort(best) <= _effort(one):
            break
        fitted = _fitted(bases[one.row.program], one, rivals)
        best = fitted if best is None or _effort(fitted) < _effort(best) else best
    assert best is not None
    return best.row


def _fitted(base: Fit, one: Sized, rivals: tuple[Instance, ...]) -> Sized:
    """The same as `_linear` with the machine and the rivals fitted, from where it ended; where it
    found no size, from where the effect's file begins.
    """
    row, instance = one.row, one.instance
    first = instance.effect.size.starts[0] if row.size is None else row.size
    rivalry = Rivalry(base, instance, rivals)

    def share(values: dict[str, float]) -> tuple[float, list[Instance]]:
        shown, left, nearest = rivalry.distances(values)
        return visible(base, instance, shown, left), nearest

    return sized(instance, row.others | {row.parameter: first}, row.program, share)


def visible(base: Fit, instance: Instance, shown: float, left: float) -> float:
    """What an effect shows over what naming it takes, as amplitudes: E and E_sep over theirs."""
    needed = 2 * THRESHOLD + cost_of(base.problem, instance)
    return float(np.sqrt(max(min(shown / needed, left / SETTLED), 0.0)))


def _nearest(stage: _Stage, instance: Instance, change: Array) -> tuple[list[Instance], float]:
    """The rivals that come nearest to a change, and what the first leaves of it: E_sep less what
    the effect's parameters cost beyond the rival's.
    """
    near = {
        other: max((float(np.sum((change @ s) ** 2)) for s in subspaces), default=0.0)
        for other, subspaces in stage.rivals.items()
        if other != instance
    }
    problem, power = stage.behind.fit.problem, float(change @ change)
    own = cost_of(problem, instance)
    left = {i: power - near[i] + cost_of(problem, i) - own for i in near if near[i] > LIKE * power}
    return sorted(left, key=lambda i: left[i]), min([power, *left.values()])
