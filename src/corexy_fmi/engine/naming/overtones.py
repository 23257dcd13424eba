"""Pulses too fast or weak to be seen one by one: a sine that was found may be their overtone.

A stage that rings shows of a train of pulses what lies near its mode.  The train's k-th overtone is

    2 h / (k pi) sin(pi k d) cos(2 pi k f (t - t_c)),   h: height, d: duty, t_c: middle of a pulse

so that a sine of a known size and phase leaves k places for the pulses of each recording.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from corexy_fmi.effects.api import TWO_PI
from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise, settle
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.aliases import sines_alike
from corexy_fmi.engine.naming.matched import matched
from corexy_fmi.engine.naming.pulses import EFFECT
from corexy_fmi.kernel.call import Array

OVERTONES, DUTIES = 6, (0.1, 0.2, 0.3, 0.5, 0.7, 0.85)
TRIED, LONG = 4, 10  # trains that are fitted; iterations


def overtone_fits(base: Fit, fits: list[Fit], mapper: Mapper) -> list[Fit]:
    """Settled fits of pulses that the best fit, if it has a sine in time, is an overtone of, or an
    alias of one; and of the sine where it fits better at an alias.
    """
    first = fits[0] if fits else base
    uses = first.problem.hypothesis.uses
    found = [i for i in uses if i.effect.name == EFFECT]
    if first.problem.hypothesis.shaped or not found:
        return []
    new = found[0] not in base.problem.hypothesis.uses
    others = sines_alike(base, first, found[0]) if new else []
    trains = [_train(sine, mapper) for sine in (first, *others)]
    return [min(trains, key=lambda fit: fit.cost), *others]


def _train(sine: Fit, mapper: Mapper) -> Fit:
    """The settled fit of pulses that a sine is an overtone of."""
    shaped = replace(sine.problem, hypothesis=replace(sine.problem.hypothesis, shaped=True))
    pairs = [(k, duty) for k in range(1, OVERTONES + 1) for duty in DUTIES if _share(k, duty)]
    reach = [np.linalg.qr(sine.jacobian[part])[0] for part in shaped.parts]
    placed = list(mapper(lambda pair: _placed(shaped, sine, reach, *pair), pairs))
    best = sorted(placed, key=lambda found: found[0])[:TRIED]
    fitted = mapper(lambda found: minimise(shaped, found[1], LONG), best)
    return settle(matched(min(fitted, key=lambda fit: fit.cost), mapper))


def alone(fit: Fit) -> Fit:
    """Pulses or a sine that were found beside another cause, settled without it: the mean of pulses
    is a force that a sine leaves to another cause.
    """
    both = fit.problem.hypothesis
    uses = tuple(i for i in both.uses if i.effect.name == EFFECT)
    problem = replace(fit.problem, hypothesis=Hypothesis(uses, shaped=both.shaped))
    return settle(minimise(problem, problem.carried(fit.problem, fit.u), LONG))


def _share(k: int, duty: float) -> float:
    """The k-th overtone over the pulses' height; 0 where they have next to none."""
    share = 2 / (k * math.pi) * math.sin(math.pi * k * duty)
    return share if abs(share) > 0.02 else 0.0


def _placed(
    shaped: Problem, sine: Fit, reach: list[Array], k: int, duty: float
) -> tuple[float, Array]:
    """Cost and start of pulses whose k-th overtone is a sine, each run's at its best place.

    ``reach``: for each run, an orthonormal basis of what its own retuning can do.
    """
    known = {x.key: float(x.value(sine.u[n])) for n, x in enumerate(sine.problem.unknowns)}
    rows = np.repeat(shaped.carried(sine.problem, sine.u)[None], k, axis=0)
    own: dict[int, int] = {}
    (location,) = (i.location for i in shaped.hypothesis.uses if i.effect.name == EFFECT)
    prefix = f"{EFFECT}.{location}."
    for n, x in enumerate(shaped.unknowns):
        name = x.key.removeprefix(prefix) if x.key.startswith(prefix) else ""
        if name == "amplitude":
            rows[:, n] = x.internal(known[x.key] / abs(_share(k, duty)))
        elif name == "frequency":
            rows[:, n] = x.internal(known[x.key] / k)
        elif name == "duty":
            rows[:, n] = x.internal(duty)
        elif x.run is not None and name.startswith("phase@"):
            own[x.run] = n
            rows[:, n] = [x.internal(_phase(known[x.key], k, duty, place)) for place in range(k)]
    white = shaped.residual(rows)
    costs = [_cost(white[:, part], q) for part, q in zip(shaped.parts, reach, strict=True)]
    start = rows[0].copy()
    for run, n in own.items():
        start[n] = rows[int(np.argmin(costs[run])), n]
    return float(sum(cost.min() for cost in costs)), start


def _cost(white: Array, q: Array) -> Array:
    """Squares (sets,) of one run's residuals (sets, n), off a basis (n, size)."""
    return np.asarray(np.sum((white - (white @ q) @ q.T) ** 2, axis=1))


def _phase(sine: float, k: int, duty: float, place: int) -> float:
    """Phase [rad] of the pulses, -pi .. pi, from that of the sine and which of k places they take.

    A pulse begins where f t + phase / 2 pi is whole, half a duty before its middle t_c.
    """
    turned = 0.0 if _share(k, duty) > 0 else 0.5
    middle = (0.25 - sine / TWO_PI + turned + place) / k  # f t_c
    turns = 0.5 * duty - middle
    return TWO_PI * (turns - round(turns))
