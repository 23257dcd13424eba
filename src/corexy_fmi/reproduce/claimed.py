"""The claims of the paper on P1, P0, P2 and on sets drawn from physical ranges."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.machine import Machine
from corexy_fmi.reproduce.claims import CRITERIA, JUDGED, judge
from corexy_fmi.reproduce.claims_tables import evidence, pulses
from corexy_fmi.reproduce.gain import gain
from corexy_fmi.reproduce.measure import measure
from corexy_fmi.reproduce.paper import CHOSEN, CLAIMS, OTHER, SETS, bundled
from corexy_fmi.reproduce.result import Cell, Result, Table
from corexy_fmi.reproduce.sets import REFERENCE, Parameters, drawn
from corexy_fmi.reproduce.study import DRY, OVERDAMPED, overdamped, quantities, splits

CORE = JUDGED[:6]
ALL = "all of (a)-(f), (f) without Coulomb friction"
BOTH = "zeta above 1 in both axes, of those where all claims hold"
TOLD = 3  # quantities named for each claim
ORDER = ("P1", "P0", "P2")
NOTES = (
    "a claim holds by this project's criteria; the paper states it in words",
    "where a set overshoots, eq. (17) reads near zero: read it beside the overshoot",
    "(e) is judged from x to y, as the reference is; from y to x its numbers stand in the table",
    "on P0 and P2 eq. (17) mostly reads below 0.01 mm; what holds there holds idly",
)
Flags = NDArray[np.bool_]
Report = Callable[[str, float], None]


def claims(count: int, seed: int, report: Report) -> Result:
    """Judge the three sets and ``count`` drawn ones; raises InputError for a count below 0."""
    if count < 0:
        raise InputError(f"sets: found {count}, expected at least 0 (0 draws none)")
    machines = {name: bundled(SETS[name]) for name in ORDER}
    named = [dict(machine.parameters) for machine in machines.values()]
    measures = measure(named)
    verdicts = judge(measures)
    tables = [_verdict_table(verdicts), evidence(ORDER, measures, named), pulses(named[0])]
    known, held, notes = {}, np.zeros(0, dtype=bool), []
    sets = drawn(bundled(REFERENCE).parameters, count, seed)
    tables.append(gain(ORDER, named, sets))
    if count:
        judged = judge(measure(sets, lambda share: report("drawn sets", share)))
        known, held = quantities(sets), np.all([judged[name] for name in CORE], axis=0)
        tables += [_fractions(judged, held), _deciders(known, judged | {ALL: held})]
        tables.append(_regime(overdamped(known), np.minimum(*_dampings(known)) > 1, held))
        notes.append(f"{count} sets, seed {seed}, log-uniform in the specification's ranges, each "
                     "parameter by itself, lengths as in P1")  # fmt: skip
    return Result(
        name="claims",
        title="The paper's claims (a)-(f)",
        label=_label(machines),
        command=f"corexy reproduce claims --sets {count} --seed {seed}",
        tables=tuple(tables),
        notes=(*notes, *NOTES),
        draw=(lambda figure: _draw(figure, known, held, named)) if count else None,
    )


def _label(machines: Mapping[str, Machine]) -> str:
    words = [f"{key} ({m.name}): {m.surrogate or OTHER}" for key, m in machines.items()]
    return "; ".join([*words, CHOSEN])


def _verdict_table(verdicts: Mapping[str, Flags]) -> Table:
    """Held or not, for each claim and named set."""
    rows = []
    for name in JUDGED:
        letter, _, more = name.partition(" ")
        flags = ("held" if flag else "not held" for flag in verdicts[name])
        words = f"{CLAIMS[letter]} ({more})" if more else CLAIMS[letter]
        rows.append((letter, words, *flags, CRITERIA[letter]))
    return Table("Claims", ("claim", "in words", *ORDER, "criterion"), tuple(rows))


def _fractions(judged: Mapping[str, Flags], held: Flags) -> Table:
    rows: list[tuple[Cell, ...]] = [(f"({name})", float(judged[name].mean())) for name in JUDGED]
    rows.append((ALL, float(held.mean())))
    return Table("Share of the drawn sets in which each holds", ("claim", "share"), tuple(rows))


def _deciders(known: Mapping[str, NDArray[np.float64]], judged: Mapping[str, Flags]) -> Table:
    """The most telling quantities of each claim."""
    head = ("claim", "holds rather where", "put right", "rank correlation")
    rows: list[tuple[Cell, ...]] = []
    for name, holds in judged.items():
        for cut in splits(known, holds)[:TOLD]:
            where = f"{cut.quantity} {cut.side} {cut.at:.3g}"
            rows.append((name, where, cut.score, cut.rank))
    return Table("What decides a claim: one quantity, cut once (0.5 is chance)", head, tuple(rows))


def _dampings(known: Mapping[str, NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    return [known[name] for name in OVERDAMPED]


def _regime(inside: Flags, beyond: Flags, held: Flags) -> Table:
    """How well the specification's regime tells where all claims hold."""
    limits = " and ".join(f"{name} > {limit:g}" for name, limit in OVERDAMPED.items())
    share = lambda flags: float(flags.mean()) if len(flags) else None  # noqa: E731
    rows = (
        ("sets inside", share(inside)),
        ("all claims hold, inside", share(held[inside])),
        ("all claims hold, outside", share(held[~inside])),
        ("inside, of those where all claims hold", share(inside[held])),
        (BOTH, share(beyond[held])),
    )
    title = f"The overdamped regime: {limits}, Coulomb friction below {DRY:.0%} of both drags"
    return Table(title, ("share of sets", "value"), rows)


def _draw(
    figure: Figure,
    known: Mapping[str, NDArray[np.float64]],
    held: Flags,
    named: list[Parameters],
) -> None:
    """Damping of both axes: where all claims hold, where not, and the named sets."""
    axes = figure.subplots()
    for flags, colour, word in (
        (~held, "#bbbbbb", "not all"),
        (held, "#1f5fbf", "all claims hold"),
    ):
        x, y = known["zeta_x"][flags], known["zeta_y"][flags]
        axes.plot(x, y, ".", color=colour, markersize=3, label=word, rasterized=True)
    points = quantities(named)
    for name, x, y in zip(ORDER, points["zeta_x"], points["zeta_y"], strict=True):
        axes.plot(x, y, "*", color="#d95f02", markersize=11)
        axes.annotate(name, (x, y), (6, 4), textcoords="offset points")
    axes.axvline(OVERDAMPED["zeta_x"], color="#444444", linewidth=0.6)
    axes.axhline(OVERDAMPED["zeta_y"], color="#444444", linewidth=0.6)
    axes.set(xscale="log", yscale="log", xlabel="damping ratio in x", ylabel="damping ratio in y")
    axes.legend(loc="lower right")
