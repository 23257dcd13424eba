"""Commands whose rows are far apart: a curve through them, where that is what the stage followed.

Commanded angles are linear between rows (CONTRACT 2).  Where a log holds few of the rows that its
controller played, that cuts every curve: an acceleration a between rows h apart by a h^2 / 12 in
the mean, which looks like a compliance.  Whether a spline is nearer is asked of the samples: of
what it changes in the response they must hold all, neither a part nor a multiple.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.data.samples import LONG, Run
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.engine.fitting.fit import Fit, Mapper, costs, minimise, settle
from corexy_fmi.engine.fitting.restart import best
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.kernel.call import Array
from corexy_fmi.recording.record import ANGLES

PARTS = 5  # rows in place of one
PLAIN = 12.0  # [nats] that a curve must gain at least
SEEN = PLAIN / 2  # [nats] that it must change in the response at least to do so
ALL, SIGMAS = 0.3, 3.0  # how far from 1 the share of it may be that samples hold, or by its scatter


def led(base: Fit, beside: Fit, mapper: Mapper) -> Fit:
    """The retuned machine under commands led smoothly through their rows, where what a fit (itself,
    or one with a cause ``beside``) leaves of the samples asks for just that; else as it is.
    """
    rows = PARTS * sum(len(run.excitation.time) for run in base.problem.runs)
    if rows > LONG or not _held(beside):
        return base
    again = _refitted(beside)
    if again.cost > beside.cost - PLAIN:
        return base
    anew = retune(base.problem.layout, base.problem.machine, _smoothed(base), mapper)
    return best([anew, again if beside is base else _refitted(base)])


def alike(runs: Sequence[Run], base: Fit) -> list[Run]:
    """Other runs, their commands led as those of a fit are."""
    return [smooth(r) for r in runs] if any(r.curved for r in base.problem.runs) else list(runs)


def told(base: Fit) -> list[Finding]:
    """What is to be said of commands that were led."""
    runs = [run for run in base.problem.runs if run.curved]
    if not runs:
        return []
    apart = max(float(np.median(np.diff(run.excitation.time))) for run in runs) * PARTS
    text = (
        f"commands are logged every {1e3 * apart:.3g} ms: between their rows the stage followed a "
        "curve, not straight lines"
    )
    return [
        Finding(text, "Log commands more often; they are led smoothly through their rows here.")
    ]


def smooth(run: Run) -> Run:
    """The run with `PARTS` rows in place of each, its angles on a cubic spline through theirs; as
    it is where no angles are commanded.
    """
    e, record = run.excitation, run.recording
    if e.mode != "angles" or run.curved:
        return run
    time = _between(e.time)
    angles = {
        n: _course(run, n, i, time) for n, i in zip(ANGLES, (e.input1, e.input2), strict=True)
    }
    channels = {n: _spread(v) for n, v in record.channels.items()}
    samples = tuple(replace(s, index=PARTS * s.index) for s in run.samples)
    return replace(
        run,
        recording=replace(record, time=time, channels=channels | angles),
        excitation=replace(e, time=time, input1=angles[ANGLES[0]], input2=angles[ANGLES[1]]),
        samples=samples,
        curved=True,
    )


def _between(time: Array) -> Array:
    """Times (n,) with those between them, (`PARTS` (n - 1) + 1,)."""
    shares = np.arange(PARTS) / PARTS
    inner = time[:-1, None] + np.diff(time)[:, None] * shares
    return np.append(inner, time[-1])


def _course(run: Run, name: str, values: Array, time: Array) -> Array:
    """An angle's values (n,) at other times (m,), on a spline through those rows that tell it."""
    from scipy.interpolate import CubicSpline

    given = run.recording.channels.get(name, values)
    known = np.isfinite(given)
    first, last = np.flatnonzero(known)[[0, -1]]
    known[:first] = known[last:] = True  # before and behind them an angle stays as it is
    return np.asarray(CubicSpline(run.excitation.time[known], values[known])(time))


def _spread(values: Array) -> Array:
    """A channel (n,) with blanks for the rows between."""
    result = np.full(PARTS * (len(values) - 1) + 1, np.nan)
    result[::PARTS] = values
    return result


def _held(fit: Fit) -> bool:
    """Whether samples hold what curves would change in the response as it is: a share near 1 of
    it, beside any change of the fit's unknowns, that gains more than `PLAIN`.
    """
    runs = _smoothed(fit)
    if not any(a is not b for a, b in zip(runs, fit.problem.runs, strict=True)):
        return False
    curved = replace(fit.problem, runs=runs).residual(fit.u[None])[0]
    change = fit.residual - curved
    if not np.isfinite(curved).all() or costs(change[None])[0] < SEEN:
        return False
    sides = np.column_stack([fit.residual, change])
    basis = np.linalg.qr(fit.jacobian)[0]
    left, change = (sides - basis @ (basis.T @ sides)).T
    size = float(change @ change)
    share = float(change @ left) / size
    return 0.5 * share**2 * size > PLAIN and abs(share - 1) < max(ALL, SIGMAS / np.sqrt(size))


def _smoothed(fit: Fit) -> tuple[Run, ...]:
    return tuple(smooth(run) for run in fit.problem.runs)


def _refitted(fit: Fit) -> Fit:
    """The fit carried on under commands led smoothly."""
    return settle(minimise(replace(fit.problem, runs=_smoothed(fit)), fit.u))
