"""In words: what an unexplained mismatch looks like, and why no catalogued effect was named."""

from __future__ import annotations

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape, law_values, onsets, viscous_share
from corexy_fmi.engine.judging.period import period
from corexy_fmi.engine.judging.prove import Proof
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming.entries import Competition
from corexy_fmi.engine.places.family import at_end

NEAREST = 3  # catalogued sets that are told


def in_words(fit: Fit, competition: Competition, verdict: Verdict, proof: Proof) -> str:
    """Coordinate, argument, parity, size and period of what is missing; what came nearest."""
    parts = [
        _law(fit, verdict),
        f"no more than a curve: {verdict.reason}" if verdict.entry and verdict.reason else "",
        _sites(verdict),
        period(proof),
        _carried_over(fit, proof),
        _failed(competition),
    ]
    return "; ".join(part for part in parts if part)


def _law(fit: Fit, verdict: Verdict) -> str:
    law = fit.problem.hypothesis.law
    if law is None:
        return f"no catalogued effect and no law explains the mismatch: {verdict.reason}"
    return shape(fit, law)


def shape(fit: Fit, law: LawShape) -> str:
    """In words a law's place, argument, parity and size."""
    values = law_values(fit, law)
    size, odd = (values.max() - values.min()) / 2, f", {law.parity}" if law.parity else ""
    what = "a force on" if law.acts == "force" else "a Coulomb friction of"
    where = f"{what} {law.location} that depends on {law.argument}{odd}"
    return f"{where}, +-{size:.3g} {law.unit} over the range seen{_more(fit, law)}"


def _more(fit: Fit, law: LawShape) -> str:
    """How a friction grows with speed, and when its time begins in each recording."""
    if not law.since:
        return ""
    share = viscous_share(fit, law)
    grows = f", larger by {share:.3g} of itself for each m/s" if share else ""
    times = zip(fit.problem.runs, onsets(fit, law), strict=True)
    begins = [f"{onset:+.2f} s in {run.name}" for run, onset in times if run.name != law.since]
    return f"{grows}, by the time of {law.since}{''.join(f', which begins at {b}' for b in begins)}"


def _sites(verdict: Verdict) -> str:
    """Where simple laws explain most of it, and which one does first."""
    if verdict.site is None:
        return ""
    told = [f"{s.location} ({s.word}, {s.gain:.0f} nats)" for s in verdict.sites[:NEAREST]]
    return f"simple laws explain most at {told[0]}" + "".join(f", less at {t}" for t in told[1:])


def _carried_over(fit: Fit, proof: Proof) -> str:
    """What the law gains on data that it was not fitted to."""
    gains = proof.gains("holdout")
    if fit.problem.hypothesis.law is None:
        return ""
    told = f"on data kept back it gains {sum(gains):.0f} nats" if gains else ""
    return "; ".join(part for part in (told, proof.silent) if part)


def _failed(competition: Competition) -> str:
    """The nearest catalogued sets, and how far they stay behind."""
    most = competition.entries[0].gain if competition.entries else 0.0
    near = [e for e in competition.entries if e.hypothesis.uses][:NEAREST]
    told = [f"{e.hypothesis.label} (gains {max(e.gain, 0):.0f} nats{_end(e.fit)})" for e in near]
    behind = f" of {most:.0f}" if near and near[0] is not competition.entries[0] else ""
    return f"the nearest catalogued causes explain less{behind}: {'; '.join(told) or 'none'}"


def _end(fit: Fit) -> str:
    """Which of a set's parameters ended where their family does."""
    return "".join(f", its {name} at the end of its range" for name in at_end(fit))
