"""A law over time with a time of its own in each recording; a friction's may grow with speed, too.

What happens to a machine in time begins when it does, not when a recording begins; and what changes
a rail's Coulomb friction mostly changes its viscous friction, too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from corexy_fmi.engine.data.samples import LONG
from corexy_fmi.engine.fitting.fit import Fit, costs
from corexy_fmi.engine.fitting.free_form import LawShape, law_values, onset_key, onsets
from corexy_fmi.engine.naming.again import with_laws
from corexy_fmi.engine.naming.entries import THRESHOLD
from corexy_fmi.engine.naming.search import rank

SHIFTS = (-0.5, -0.25, -0.1, 0.1, 0.25, 0.5)  # of a run's length, from which its onset begins


def with_own_times(fit: Fit) -> Fit:
    """A law over time with an onset in each recording but the first, viscous where it is a
    friction, where that pays; any other fit as it is.  Excerpts of long recordings have one time.
    """
    law, runs = fit.problem.hypothesis.law, fit.problem.runs
    if law is None or law.argument != "t" or fit.problem.hypothesis.beside:
        return fit
    if 2 * sum(len(run.excitation.time) for run in runs) > LONG:
        return fit
    free = _again(fit, replace(law, since=runs[0].name, fastest=_fastest(fit)))
    for start in (free, _shifted(free)):
        free = min(free, _reaching(_again(start, start.problem.hypothesis.law)), key=rank)
    return free if rank(free) < rank(fit) - THRESHOLD else fit


def _fastest(fit: Fit) -> float:
    """The fastest speed [m/s] of an axis in any recording."""
    runs = range(len(fit.problem.runs))
    out = [fit.problem.simulate(fit.u[None], r, ("vx", "vy"))[0] for r in runs]
    return max(float(np.quantile(np.abs(v), 0.99)) for v in out)


def _again(fit: Fit, law: LawShape | None) -> Fit:
    assert law is not None
    known = fit.problem.hypothesis.law
    assert known is not None
    return with_laws(fit, [law], [np.interp(law.knots, known.knots, law_values(fit))])


def _shifted(fit: Fit) -> Fit:
    """The fit with each recording's onset where it costs least, all else as it is."""
    problem, u = fit.problem, fit.u.copy()
    law = problem.hypothesis.law
    assert law is not None
    for run in problem.runs[1:]:
        k = problem.keys.index(onset_key(law, run.name))
        tried = np.repeat(u[None], len(SHIFTS) + 1, axis=0)
        length = float(np.ptp(run.excitation.time))
        tried[1:, k] = [problem.unknowns[k].internal(s * length) for s in SHIFTS]
        u = tried[int(np.argmin(costs(problem.residual(tried))))]
    residual = problem.residual(u[None])
    return Fit(problem, u, float(costs(residual)[0]), residual[0])


def _reaching(fit: Fit) -> Fit:
    """The fit with its law's knots over all times that its recordings have by their own onsets."""
    law = fit.problem.hypothesis.law
    assert law is not None
    time = [run.excitation.time for run in fit.problem.runs]
    seen = np.array([(t[0] - o, t[-1] - o) for t, o in zip(time, onsets(fit, law), strict=True)])
    wide = np.linspace(seen.min(), seen.max(), len(law.knots))
    return _again(fit, replace(law, knots=tuple(wide.tolist())))
