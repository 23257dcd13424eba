"""The verdict with its proof: replays on data kept back, which may only lower it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.data.samples import LONG, Run, judged
from corexy_fmi.engine.fitting.clean import without_spikes
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.louder import loudest
from corexy_fmi.engine.fitting.quiet import LOUDER
from corexy_fmi.engine.fitting.resolution import at_resolution
from corexy_fmi.engine.judging.axes import uneven
from corexy_fmi.engine.judging.doubt import (
    incomplete,
    misplaced,
    still_loud,
    unfinished,
    with_curve,
)
from corexy_fmi.engine.judging.further_off import another_machine, beside_retuned
from corexy_fmi.engine.judging.local import is_local, last_parts
from corexy_fmi.engine.judging.model import tuned_machine
from corexy_fmi.engine.judging.predict import carried
from corexy_fmi.engine.judging.prove import Proof, channel_noise, prove, replay
from corexy_fmi.engine.judging.reach import beyond_reach, within_reach
from corexy_fmi.engine.judging.repeats import repeating
from corexy_fmi.engine.judging.rest import restless
from corexy_fmi.engine.judging.steady import unsteady
from corexy_fmi.engine.judging.unchanging import unchanging
from corexy_fmi.engine.judging.verdict import Verdict, decide, harmless
from corexy_fmi.engine.naming.entries import Competition, form_floor
from corexy_fmi.engine.naming.smooth import as_told
from corexy_fmi.engine.naming.specification import Leftover, leftover
from corexy_fmi.engine.naming.whole import broken
from corexy_fmi.engine.naming.worth import WHOLE
from corexy_fmi.engine.places.site import Site
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine

EXCESS, WEAK_EXCESS = 1.4, 1.3  # held-out rms over noise that forbids `nothing_missing`


def judge(
    layout: Layout,
    machine: Machine,
    competition: Competition,
    kept: Sequence[Run],
    whole: Sequence[Run],
    weak: bool,
    sites: Sequence[Site] = (),
    beside: Sequence[Site] = (),
) -> tuple[Verdict, Fit, Proof]:
    """The verdict with its fit and proof; where held-out data, ``sites`` that explain more, or
    those ``beside`` the winner that still explain much, lower it, proved again.
    """
    for fit in _clear(competition):
        tuned = tuned_machine(fit, machine.name)
        kept = _despiked(layout, tuned, competition, kept)
        whole = _despiked(layout, tuned, competition, whole)
    first = decide(competition, None)
    fit = _final(competition, first)
    proof = _prove(layout, machine, competition, fit, kept, whole)
    verdict = decide(competition, proof, weak)
    if _final(competition, verdict) is not fit:
        fit = _final(competition, verdict)
        proof = _prove(layout, machine, competition, fit, kept, whole)
    verdict = another_machine(beside_retuned(verdict, competition))
    guarded = _guarded(proof, weak, verdict, competition.retuned, fit, sites, beside)
    guarded = replace(guarded, sites=tuple(sites))
    if _final(competition, guarded) is not fit:
        fit = _final(competition, guarded)
        proof = _prove(layout, machine, competition, fit, kept, whole)
    shown = with_curve(guarded, competition)
    if shown is not guarded and shown.entry is not None:
        curve = as_told(shown.entry)
        seen = _prove(layout, machine, competition, curve.fit, kept, whole)
        if harmless(seen):
            return replace(shown, entry=curve), curve.fit, seen
    return guarded, fit, proof


def _clear(competition: Competition) -> list[Fit]:
    """The fits beside which spikes are looked for: the retuned machine, and the best cause."""
    best = competition.best
    return [competition.retuned, *([best.fit] if best and not is_local(best.fit) else [])]


def _despiked(
    layout: Layout, tuned: Machine, competition: Competition, kept: Sequence[Run]
) -> list[Run]:
    """The data kept back without their spikes, as the training data were fitted."""
    train, noise = competition.retuned.problem.runs, competition.retuned.problem.noise
    runs = [judged(run, train) for run in kept]
    fits = [replay(layout, tuned, r, channel_noise(train, noise, r)).fit for r in runs]
    return [run for fit in fits for run in without_spikes(fit)]


def _final(competition: Competition, verdict: Verdict) -> Fit:
    """The fit that the verdict stands on."""
    missing = verdict.entry is not None and verdict.word != "nothing_missing"
    return verdict.entry.fit if missing and verdict.entry else competition.retuned


def _prove(
    layout: Layout,
    machine: Machine,
    competition: Competition,
    fit: Fit,
    runs: Sequence[Run],
    whole: Sequence[Run],
) -> Proof:
    """Replays of what was fitted, or in place of excerpts of the ``whole``, and of held-out runs,
    as far as training reached what a law depends on.

    What belongs to one excerpt cannot be replayed on the whole.
    """
    retuned, given = competition.retuned, runs
    runs = within_reach(fit, given)
    machines = {
        "nominal": machine,
        "retuned": tuned_machine(retuned, machine.name),
        "explained": tuned_machine(fit, machine.name),
    }
    train = fit.problem.runs
    late = last_parts(retuned, fit, runs, machine)
    own = {
        (state, role, run.name): tuned_machine(f, machine.name, r)
        for role, pair in (("train", (retuned, fit)), ("holdout", (late.retuned, late.fit)))
        for state, f in zip(("retuned", "explained"), pair, strict=True)
        for r, run in enumerate(f.problem.runs)
    }
    shown = whole if whole and not is_local(fit) else train
    late_parts = (r for r in late.kept if r.role == "holdout")
    parts = [r for r in late_parts if not is_local(fit) or r.name in late.before]
    parts = within_reach(late.fit, parts)
    abroad = _abroad(fit, runs) if is_local(fit) else []
    own |= {("explained", "holdout", run.name): found for run, found in abroad}
    fits = {"retuned": retuned, "explained": fit}
    shown = (*shown, *parts, *(run for run, _ in abroad))
    proof = prove(layout, machines, shown, train, fit.problem.noise, own, late.before, fits)
    return replace(proof, silent=beyond_reach(given, runs))


def _abroad(fit: Fit, runs: Sequence[Run]) -> list[tuple[Run, Machine]]:
    """The recordings kept back with the machine of a fit with parameters of single recordings on
    each; not those above `LONG` rows.
    """
    train, noise, name = fit.problem.runs, fit.problem.noise, fit.problem.machine.name
    known = {run.name for run in train}
    others = [judged(run, train) for run in runs if run.name not in known]
    return [
        (run, tuned_machine(carried(fit, run, channel_noise(train, noise, run)), name))
        for run in others
        if len(run.excitation.time) <= LONG
    ]


def _guarded(
    proof: Proof,
    weak: bool,
    verdict: Verdict,
    retuned: Fit,
    fit: Fit,
    sites: Sequence[Site],
    beside: Sequence[Site],
) -> Verdict:
    """What a fit leaves to simple functions of the motion or to laws of some place, or explains
    less of than simple laws at another place do, or what is far above the noise in one recording,
    forbids to call it an explanation; a mismatch on the data kept back, only in motion, in every
    loop, or slow in one axis alone forbids ``nothing_missing``.  What is no more than rounding
    shows none of that.
    """
    if at_resolution(retuned):
        return _unless_late(Verdict("nothing_missing", None), proof, weak)
    left, winner = leftover(fit), verdict.entry.gain if verdict.entry else 0.0
    if verdict.word == "explained" and at_resolution(fit):
        return replace(verdict, stands=left)
    if verdict.word != "unexplained" and left.matters(winner) and _tells(left, retuned, fit):
        return incomplete(verdict, f"the {left.cause} still explains part of it", left)
    if verdict.word != "unexplained" and (count := broken(fit)):
        return incomplete(verdict, f"which would have to be {count}")
    if verdict.word != "unexplained" and (lasting := unchanging(fit)):
        return incomplete(verdict, lasting)
    verdict = still_loud(verdict, proof)
    waves = unsteady(fit)
    if verdict.word != "unexplained" and waves.matters(winner):
        return incomplete(verdict, f"{waves.cause} changes from part to part")
    loud = loudest(fit)
    if verdict.word != "unexplained" and loud and loud.ratio > LOUDER:
        return incomplete(verdict, loud.told)
    spent = left.score < WHOLE and not beside
    verdict = unfinished(misplaced(verdict, sites, spent), beside, form_floor(fit))
    verdict = replace(verdict, stands=left)
    if verdict.word != "nothing_missing":
        return verdict
    axis, slow = uneven(retuned)
    found = _unless_late(verdict, proof, weak, restless(proof) or repeating(proof) or slow)
    alone = found.word == "unexplained" and found.reason == slow
    return replace(found, left=Leftover(0.0, 0.0, slow, axis)) if alone else found


def _tells(left: Leftover, retuned: Fit, fit: Fit) -> bool:
    """Whether what a fit leaves is more than a wrong shape may."""
    return left.gain > form_floor(fit) and not left.is_trace(retuned, fit)


def _unless_late(nothing: Verdict, proof: Proof, weak: bool, reason: str = "") -> Verdict:
    """``nothing_missing``, unless the data kept back, or another reason, speak against it."""
    late, limit = proof.pooled("retuned", "holdout"), WEAK_EXCESS if weak else EXCESS
    if np.isfinite(late) and late > limit:
        reason = f"the mismatch of the data kept back is {late:.1f} times the noise"
    return Verdict("unexplained", None, reason=reason) if reason else nothing
