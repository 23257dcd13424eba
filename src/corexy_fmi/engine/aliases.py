"""Aliases: samples every T cannot tell a tone from those at m / T - f and m / T + f.

A 100 Hz tracker shows the third overtone of pulses at 27.65 Hz at 17.05 Hz.  What a stage that
rings shows of pulses may be such an overtone, and what is found first a sine at its alias.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.abreast import alone
from corexy_fmi.engine.beyond import at_step_of, beyond
from corexy_fmi.engine.by_run import by_run
from corexy_fmi.engine.fit import Fit, minimise, settle
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.signature import row_of
from corexy_fmi.engine.spread import spread
from corexy_fmi.kernel.layout import Instance

FOLDS = 2  # sampling rates around which a tone is mirrored
ALIKE = 0.3  # share of the sine's gain that is worth a fit
LOUDER = 10.0  # times the sine's amplitude, at most: the stage hardly moves so fast
LONG = 10  # iterations


def aliases(problem: Problem, frequency: float) -> tuple[float, ...]:
    """Frequencies [Hz] that the samples cannot tell from this one; none where channels differ."""
    spacings = [
        float(np.median(np.diff(run.excitation.time[s.index])))
        for run in problem.runs
        for s in run.samples
        if len(s.index) > 1
    ]
    if not spacings or max(spacings) > 1.01 * min(spacings):
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
    u, gain = problem.carried(base.problem, base.u), base.cost - sine.cost
    most = LOUDER * sine.value(f"{prefix}amplitude")
    found = []
    for f in aliases(problem, sine.value(f"{prefix}frequency")):
        steps = by_run(behind, problem, instance, u, replace(offered, frequency=(f,)))
        score = alone(steps)[0]
        if score.gain > ALIKE * gain and score.values["amplitude"] < most:
            start = row_of(problem, u, instance, score.values)
            found.append(settle(minimise(problem, start, LONG)))
    return [fit for fit in found if fit.cost < sine.cost]
