"""What belongs to one recording, proved on that recording: fitted on its first part, judged on its
last.

Missed steps of one file or the phase of a fan in it say nothing about another file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from corexy_fmi.engine.data.samples import GAP, Run, split_in_time
from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.machine import Machine

SLIGHT = 0.1  # share of the largest size of all runs below which a run has nothing to show
AGAIN = 8  # iterations of the fit on the first parts


@dataclass(frozen=True, eq=False)
class LastParts:
    """Both fits, the runs to judge them on, and the first parts of those, by name."""

    retuned: Fit
    fit: Fit
    kept: Sequence[Run]
    before: Mapping[str, Run] = field(default_factory=dict)


def is_local(fit: Fit) -> bool:
    """Whether a fit has parameters of single recordings, or a law whose time is that of one."""
    laws = fit.problem.hypothesis.laws
    return any(x.run is not None for x in fit.problem.unknowns) or any(law.since for law in laws)


def shows(fit: Fit) -> list[bool]:
    """For each run, whether the effects of single recordings have a size there."""
    found = [True] * len(fit.problem.runs)
    for instance in fit.problem.hypothesis.uses:
        sizes = {
            f"{instance.effect.name}.{instance.location}.{p.name}" for p in instance.effect.sizes
        }
        own = {
            x.run: abs(float(x.value(fit.u[k])) - instance.effect.size.neutral)
            for k, x in enumerate(fit.problem.unknowns)
            if x.run is not None and x.key.partition("@")[0] in sizes
        }
        for run, size in own.items():
            found[run] &= size > SLIGHT * max(own.values())
    return found


def _as_clean(part: Run, whole: Run) -> Run:
    """A part of a recording, without the samples that were left out of the whole as spikes."""
    used = {s.channel: s.index for s in whole.samples}
    samples = [s.without(~np.isin(s.index, used[s.channel])) for s in part.samples]
    return replace(whole, role=part.role, samples=tuple(samples))  # begun as the whole was


def _least(part: Run) -> int:
    """Fewest samples of a channel."""
    return min((len(s.index) for s in part.samples), default=0)


def last_parts(retuned: Fit, fit: Fit, kept: Sequence[Run], machine: Machine) -> LastParts:
    """What a fit with parameters of single recordings is judged on; any other, on ``kept``."""
    if not is_local(fit):
        return LastParts(retuned, fit, kept)
    runs = fit.problem.runs
    whole = {run.name: run for run in runs}
    on = {run.name for run, size in zip(runs, shows(fit), strict=True) if size}
    own = [r.name in whole and r.recording is whole[r.name].recording for r in kept]
    if own and all(own):  # kept back already
        return LastParts(retuned, fit, [r for r in kept if r.name in on], whole)
    halves = [
        tuple(_as_clean(part, run) for part in split_in_time(run.recording, machine, GAP))
        for run in runs
    ]
    early = tuple(a for a, _ in halves)
    if any(len(a.samples) != len(run.samples) for a, run in zip(early, runs, strict=True)):
        return LastParts(retuned, fit, kept)
    again = [minimise(replace(f.problem, runs=early), f.u, AGAIN) for f in (retuned, fit)]
    chosen = [b for _, b in halves if b.name in on and _least(b)]
    return LastParts(again[0], again[1], chosen, {run.name: run for run in early})
