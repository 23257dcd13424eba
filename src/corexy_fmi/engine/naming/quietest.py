"""Nobody takes more for noise than the best explanations leave.

Each fit is settled under the noise of its own residuals.  What it leaves slowly passes there for
colour, which costs next to nothing where rows are dense: of a skew of E0 135 000 its own fit, which
left 26 um, gained 36 nats, and a steady pull that left 43 um gained 16.  So where one of the fits
that gain a fair share is far quieter than others, its noise is the ceiling for all, of this round
and of what follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit, Mapper, minimise
from corexy_fmi.engine.fitting.quiet import LOUDER
from corexy_fmi.engine.naming.entries import THRESHOLD, form_floor
from corexy_fmi.engine.naming.search import CONTENDS, LONG, PLAIN, rank


def contenders(base: Fit, fits: Sequence[Fit]) -> list[Fit]:
    """The fits that gain a fair share of what the best one does over the retuned machine."""
    gains = [base.cost - rank(f) for f in fits]
    least = max(THRESHOLD, CONTENDS * max(gains, default=0.0))
    return [f for f, gain in zip(fits, gains, strict=True) if gain >= least]


def under_ceiling(base: Fit, fits: list[Fit], mapper: Mapper) -> tuple[Fit, list[Fit]]:
    """The retuned machine, its noise its own, and the fits, best first, under the noise of the
    quietest of those that gain a fair share, where another of these leaves far more; as they are
    anywhere else.
    """
    able = contenders(base, fits)
    quiet = min(able, key=remains, default=base)
    if not any(remains(f) > LOUDER * remains(quiet) for f in able):
        return base, fits
    base, fits, _ = held_to(quiet, base, fits, [], mapper)
    return base, fits


def quieter(one: Fit, pairs: Sequence[Fit], least: float) -> Fit | None:
    """The quietest of the pairs that gain ``least`` nats over one of their causes, and more than a
    shape may fake, if that leaves far more.
    """
    able = [f for f in pairs if rank(one) - rank(f) > max(least, THRESHOLD + form_floor(f))]
    quiet = min(able, key=remains, default=one)
    return quiet if remains(one) > LOUDER * remains(quiet) else None


def held_to(
    quiet: Fit, base: Fit, fits: Sequence[Fit], pairs: Sequence[Fit], mapper: Mapper
) -> tuple[Fit, list[Fit], list[Fit]]:
    """All with the noise of ``quiet`` as their ceiling: the retuned machine, its noise its own;
    fits and pairs, best first, those that are far louder under it, and fitted again there where
    they gained a fair share of what ``quiet`` does.
    """
    noise = (*quiet.problem.noise,)  # another object than its own: who has this one is charged
    most = LOUDER * remains(quiet)
    least = CONTENDS * (base.cost - rank(quiet))

    def again(fit: Fit) -> Fit:
        problem = replace(fit.problem, ceiling=noise)
        if remains(fit) < most:
            return replace(fit, problem=problem)
        iterations = LONG if base.cost - rank(fit) > least else 0
        return minimise(replace(problem, noise=noise), fit.u, iterations, PLAIN)

    base = replace(base, problem=replace(base.problem, ceiling=noise))
    first, second = (sorted(mapper(again, some), key=rank) for some in (fits, pairs))
    return base, first, second


def remains(fit: Fit) -> float:
    """Geometric mean [m or rad] of the standard deviations of what a fit leaves of all channels."""
    runs = range(len(fit.problem.runs))
    sizes = [float(np.std(e[0])) for r in runs for e in fit.problem.errors(fit.u[None], r)]
    return float(np.exp(np.mean(np.log(np.maximum(sizes, 1e-300)))))
