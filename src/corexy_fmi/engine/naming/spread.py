"""Where a fit begins: every combination of an effect's starts, some of them read off the data.

A parameter that is declared ``over`` the time, the position or the frequencies of the recordings
begins all over their range, and at the strongest tones of what the retuned machine leaves.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from corexy_fmi.effects.api import Parameter
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.naming.modes import modes
from corexy_fmi.engine.naming.tones import tones
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import Instance

TIMES, PLACES = 24, 9  # starts over each range


@dataclass(frozen=True)
class Spread:
    """Starts that the data offer, by what a parameter is declared ``over``, beside what ``fit``
    leaves.
    """

    time: tuple[float, ...]
    x: tuple[float, ...]
    y: tuple[float, ...]
    frequency: tuple[float, ...]
    drive: str
    threshold: tuple[float, ...] = ()
    fit: Fit | None = None
    swings: tuple[float, ...] = ()  # [Hz] where a mode begins instead, if there are any

    @cached_property
    def modes(self) -> tuple[float, ...]:
        """Frequencies [Hz] at which something may swing."""
        return modes(self.fit) if self.fit else ()

    def starts(self, instance: Instance, parameter: Parameter) -> tuple[float, ...]:
        """Values of a parameter to begin from; one that is not fitted stays at its default."""
        if self.drive not in parameter.drives or parameter.shape:
            return (parameter.starts[0] if parameter.default is None else parameter.default,)
        if not (parameter.over or parameter.heard):
            return parameter.starts
        name = instance.location if parameter.over == "position" else parameter.over
        offered: tuple[float, ...] = getattr(self, name or "frequency") or parameter.starts
        if parameter.heard:
            offered = self.swings or (*parameter.starts, *offered)
        return tuple(min(max(v, parameter.lower), parameter.upper) for v in offered)


def spread(fit: Fit) -> Spread:
    """What the runs of a fit and its residuals offer."""
    problem = fit.problem
    times = [run.excitation.time for run in problem.runs]
    names = ("x_true", "y_true")
    paths = [problem.simulate(fit.u[None], r, names)[0] for r in range(len(problem.runs))]
    x, y = np.concatenate(paths, axis=1)
    low, high = min(t[0] for t in times), max(t[-1] for t in times)
    inner = np.linspace(low, high, TIMES + 1)
    along_x, along_y = (np.linspace(v.min(), v.max(), PLACES).tolist() for v in (x, y))
    middles = ((inner[1:] + inner[:-1]) / 2).tolist()
    places = tuple(along_x), tuple(along_y)
    return Spread(tuple(middles), *places, tones(fit), problem.machine.drive, fit=fit)


def combinations(instance: Instance, offered: Spread) -> list[dict[str, float]]:
    """Parameter values to begin from: every combination, the phases of each beside each other."""
    parameters = sorted(instance.effect.parameters, key=lambda p: bool(p.periodic))
    values = [offered.starts(instance, p) for p in parameters]
    names = [p.name for p in parameters]
    return [dict(zip(names, row, strict=True)) for row in itertools.product(*values)]


def groups(instance: Instance, rows: list[dict[str, float]]) -> list[list[int]]:
    """Rows that differ by their phase alone belong together."""
    turning = {p.name for p in instance.effect.parameters if p.periodic}
    found: dict[tuple[float, ...], list[int]] = {}
    for n, row in enumerate(rows):
        key = tuple(v for name, v in row.items() if name not in turning)
        found.setdefault(key, []).append(n)
    return list(found.values())


def phase_of(instance: Instance) -> Parameter | None:
    """The phase of an effect that is a wave, if it is one."""
    return next((p for p in instance.effect.parameters if p.periodic), None)


def combined(
    rows: Sequence[Mapping[str, float]], factors: Array, phase: Parameter
) -> tuple[float, float]:
    """Size factor and phase [rad] of a sum of waves with these factors (n,)."""
    total = complex(
        sum(f * np.exp(1j * row[phase.name]) for f, row in zip(factors, rows, strict=True))
    )
    return abs(total), float(np.angle(total))
