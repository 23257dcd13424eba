"""A winner that ends where its family does: a free-form law of the same variable is asked, too.

A parameter marked ``family_ends`` may go up to its upper bound, and beyond lies another cause: a
cable that stiffens is one up to some rate, a spring on one side alone is none.  Where a winner ends
there, a law over the same variable that fits significantly better (a likelihood ratio test; Wilks,
Annals of Mathematical Statistics 9(1), 1938, doi:10.1214/aoms/1177732360) takes its place, and one
that fits as well is its equal.
"""

from __future__ import annotations

from dataclasses import replace

from scipy.stats import chi2

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.candidates import laws
from corexy_fmi.engine.naming.entries import Competition, Entry, ranked
from corexy_fmi.engine.places.spots import best_law

CHANCE = 1e-3  # of a law that fits that much better where the family holds the cause
NEAR = 1e-6  # of a bound, in the unknown's scale


def at_end(fit: Fit) -> list[str]:
    """Names of the parameters of a fit's effects that ended where their family does."""
    ends = {
        f"{i.effect.name}.{i.location}.{p.name}": p.name
        for i in fit.problem.hypothesis.uses
        for p in i.effect.parameters
        if p.family_ends
    }
    upper = fit.problem.limits()[1]
    keys = fit.problem.keys
    return [ends[key] for k, key in enumerate(keys) if key in ends and fit.u[k] > upper[k] - NEAR]


def within_family(competition: Competition) -> Competition:
    """The competition with a law beside a single cause that ended where its family does: in front
    if that fits significantly better, else as its equal if it fits no worse.  What the law gains is
    told at the price of the cause.
    """
    first = competition.best
    if first is None or len(first.hypothesis.uses) != 1 or not at_end(first.fit):
        return competition
    base = competition.retuned
    tried = [Hypothesis(law=law) for law in laws(base.problem, base.u) if _same(law, first)]
    if not tried:
        return competition
    law = best_law(base, tried, map)
    better = first.fit.cost - law.fit.cost
    if better >= chi2.isf(CHANCE, _count(law) - _count(first)) / 2:
        return ranked(base, [replace(law, gain=first.gain + better), *competition.entries])
    equal = replace(law, gain=first.gain)
    others = [e for e in competition.entries[1:] if e.hypothesis.key != law.hypothesis.key]
    return ranked(base, [first, equal, *others], equal) if better > 0 else competition


def _same(law: LawShape, entry: Entry) -> bool:
    """Whether a law acts where a cause by position does, and depends on what that depends on."""
    own = entry.hypothesis.uses[0]
    here = law.location == law.argument == own.location
    return here and own.effect.state == "position" and law.acts == "force"


def _count(entry: Entry) -> int:
    problem = entry.fit.problem
    return len(problem.unknowns) - problem.nominal_count
