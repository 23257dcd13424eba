"""Aliases: samples every T cannot tell a tone from those at m / T - f and m / T + f.

A 100 Hz tracker shows the third overtone of pulses at 27.65 Hz at 17.05 Hz.  What a stage that
rings shows of pulses may be such an overtone, and what is found first a sine at its alias.
"""

from __future__ import annotations

from dataclasses import replace

from corexy_fmi.engine.fitting.fit import Fit, minimise, settle
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.naming.abreast import abreast
from corexy_fmi.engine.naming.beyond import at_step_of, beyond
from corexy_fmi.engine.naming.by_run import by_run
from corexy_fmi.engine.naming.signature import row_of
from corexy_fmi.engine.naming.spread import spread
from corexy_fmi.kernel.layout import Instance

FOLDS = 2  # sampling rates around which a tone is mirrored
SAME = 1.01  # times: up to which two channels are sampled alike
ALIKE = 0.3  # share of the sine's gain that is worth a fit
LOUDER = 10.0  # times the sine's amplitude, at most: the stage hardly moves so fast
LONG = 10  # iterations


def aliases(problem: Problem, frequency: float) -> tuple[float, ...]:
    """Frequencies [Hz] that the samples cannot tell from this one; none where channels differ."""
    spacings = [run.spacing(s) for run in problem.runs for s in run.samples if len(s.index) > 1]
    if not spacings or max(spacings) > SAME * min(spacings):
        return ()
    rate = 1 / min(spacings)
    folded = abs(frequency - rate * round(frequency / rate))
    mirrored = (m * rate + sign * folded for m in range(FOLDS + 1) for sign in (-1, 1))
    return tuple(f for f in mirrored if f > 0 and abs(f - frequency) > 1e-3 * rate)


def sines_alike(base: Fit, sine: Fit, instance: Instance) -> list[Fit]:
    """Better fits of the sine that was found beside ``base``, at aliases of its frequency."""
    problem = replace(base.problem, hypothesis=sine.problem.hypothesis)
    prefix = f"{instance.effect.name}.{instance.location}."
    behind, offered = at_step_of(beyond(base), problem), spread(base)
    u, least = problem.carried(base.problem, base.u), ALIKE * (base.cost - sine.cost)
    most = LOUDER * sine.value(f"{prefix}amplitude")
    highest = next(p.upper for p in instance.effect.parameters if p.name == "frequency")
    tried = [f for f in aliases(problem, sine.value(f"{prefix}frequency")) if f <= highest]
    steps = [by_run(behind, problem, instance, u, replace(offered, frequency=(f,))) for f in tried]
    scores = [found[0] for found in abreast(steps)]
    starts = [s.values for s in scores if s.gain > least and s.values["amplitude"] < most]
    rows = [row_of(problem, u, instance, values) for values in starts]
    fits = [settle(minimise(problem, row, LONG)) for row in rows]
    return [fit for fit in fits if fit.cost < sine.cost]
