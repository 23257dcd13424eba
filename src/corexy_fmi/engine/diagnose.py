"""One diagnosis from end to end: compare, locate, name, model, prove."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain, repeat
from pathlib import Path
from typing import Any

from corexy_fmi.effects import own_effects
from corexy_fmi.engine.data.excerpts import excerpts
from corexy_fmi.engine.data.given import (
    kept_parts,
    make_runs,
    meaningless,
    preflight,
    unjudged,
    whole_runs,
)
from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.evidence import Evidence
from corexy_fmi.engine.fitting import between_rows, clean, resolution
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.retune import quick, retune
from corexy_fmi.engine.judging.judge import judge
from corexy_fmi.engine.judging.model import tuned_machine
from corexy_fmi.engine.judging.moving import begun, begun_alike, told
from corexy_fmi.engine.judging.onset import settled_in
from corexy_fmi.engine.judging.prove import Proof
from corexy_fmi.engine.judging.repeats import as_rows
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming import swinging
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.curved import compete_on_curves
from corexy_fmi.engine.naming.entries import Competition
from corexy_fmi.engine.naming.screen import bounds
from corexy_fmi.engine.naming.smooth import with_smooth_law
from corexy_fmi.engine.places.family import within_family
from corexy_fmi.engine.places.site import beside, sites
from corexy_fmi.engine.places.spots import with_finer, with_spot, with_times
from corexy_fmi.engine.planning.experiment import Experiment, next_experiment
from corexy_fmi.engine.telling import classes, document
from corexy_fmi.engine.telling.exhibit import exhibit
from corexy_fmi.engine.telling.walked import further
from corexy_fmi.engine.workers import workers
from corexy_fmi.kernel.layout import layout_with
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """``document`` of CONTRACT 4 without seconds, the explained machine, the evidence, and what to
    run next where the verdict is ``ambiguous``.
    """

    document: dict[str, Any]
    machine: Machine
    evidence: Evidence
    experiment: Experiment | None = None


def diagnose(
    train: Sequence[Recording],
    holdout: Sequence[Recording],
    machine: Machine,
    *,
    machine_assumed: bool = False,
    jobs: int = 1,
    effects_file: Path | None = None,
    progress: Progress | None = None,
    without: frozenset[str] = frozenset(),
) -> Diagnosis:
    """Find what a machine's model leaves out of recordings.

    ``train`` are fitted, ``holdout`` only judged.  ``progress`` hears (what is done now, share).
    ``without`` strikes effects from the catalogue, as controls of the proof do.  Raises InputError
    where a recording cannot be used.  The same input gives the same result,
    bit for bit, for any ``jobs``.
    """
    tell = progress or (lambda text, share: None)
    with workers(jobs) as mapper:
        layout = layout_with(own_effects(effects_file))
        tell("checking wiring and units", 0.0)
        train, findings = preflight(train, machine)
        holdout, more = preflight(holdout, machine)
        runs, kept = make_runs(train, holdout, machine, [*findings, *more])
        runs = begun(runs, layout, machine)
        kept = begun(kept, layout, machine) if holdout else begun_alike(kept, runs)
        runs, early = settled_in(runs, machine)
        kept, late = settled_in(kept, machine)
        begins = [*unjudged(runs, kept, holdout), *told((*runs, *kept)), *early, *late]
        without |= meaningless(runs, machine, layout)
        whole, kept = whole_runs(runs), kept_parts(kept)
        tell("retuning the nominal parameters", 0.05)
        used = tuple(excerpts(runs))
        base = retune(layout, machine, used, mapper)
        shares = chain((0.2, 0.6), repeat(0.7))
        competition = compete_on_curves(base, mapper, lambda t: tell(t, next(shares)), without)
        kept, whole = (_as_fitted(runs, competition) for runs in (kept, whole))
        tell("asking every place for a law", 0.83)
        found = sites(competition, mapper)
        competition = with_times(with_spot(competition, found, mapper), found, mapper)
        tell("asking what the winner leaves", 0.85)
        rest = beside(competition, mapper)
        competition = with_smooth_law(within_family(with_finer(competition, rest)))
        tell("proving on data kept back", 0.86)
        weak = not holdout
        verdict, fit, proof = judge(layout, machine, competition, kept, whole, weak, found, rest)
        tell("bounding what was not named", 0.93)
        leads = bounds(quick(fit), instances(layout, machine, without), mapper)
        experiment = next_experiment(verdict, competition, machine, mapper)
        reached = further(fit, mapper)
        paper = _document(
            verdict, competition, fit, proof, reached, leads, machine, machine_assumed, weak
        )
        base = competition.retuned
        alone = [*clean.told(used, base.problem.runs), *between_rows.told(base)]
        alone += [*swinging.told(base), *resolution.told(base)]
        told_first = [*findings, *more, *begins, *alone]
        paper["findings"] = [{"text": f.text, "fix": f.fix} for f in told_first]
        if loops := as_rows(proof):
            paper["repeats"] = loops
        if experiment is not None:
            paper["next_experiment"] = {
                "why": experiment.why,
                "program": experiment.order.name,
                "kept_back": experiment.kept_back,
            }
        shown = exhibit(verdict, competition, fit, proof, machine, told_first)
        tell("done", 1.0)
        return Diagnosis(paper, tuned_machine(fit, f"{machine.name}_explained"), shown, experiment)


def _as_fitted(runs: Sequence[Run], competition: Competition) -> list[Run]:
    """Other runs, led as those are that were fitted."""
    base = competition.retuned
    return swinging.alike(between_rows.alike(runs, base), base)


def _document(
    verdict: Verdict,
    competition: Competition,
    fit: Fit,
    proof: Proof,
    reached: document.Further,
    leads: list[Any],
    machine: Machine,
    assumed: bool,
    weak: bool,
) -> dict[str, Any]:
    rows = document.fit_rows(proof)
    named = set(fit.problem.hypothesis.key)
    return {
        "schema": 1,
        "verdict": verdict.word,
        "effects": document.effects(verdict, fit, competition, proof, reached),
        "nearest": document.nearest(verdict, competition),
        "ambiguous_between": classes.between(verdict.classes),
        "ambiguous_sets": classes.sets(verdict.classes),
        "next_experiment": None,
        "located": document.located(verdict, competition, proof, machine),
        "fit": rows,
        "heldout": document.heldout(rows, weak),
        "retuned": document.retuned(fit),
        "not_excluded": document.not_excluded(leads, named),
        "machine_assumed": assumed,
    }
