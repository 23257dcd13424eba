"""Doubt: what forbids to call a winner the cause, or to say that nothing is missing.

The catalogue need not hold the cause.  Its nearest member may then fit better than all others, and
well; but what it leaves is no noise, and simple laws of some place find it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from corexy_fmi.engine.judging.prove import Proof
from corexy_fmi.engine.judging.verdict import HALF, Verdict, excess_removed
from corexy_fmi.engine.naming.entries import FAMILY, THRESHOLD, Competition, Entry
from corexy_fmi.engine.naming.specification import LEAST, Leftover
from corexy_fmi.engine.places.site import Site, elsewhere, remaining

LOUD, MOST = 1.3, 0.9  # rms over noise of data kept back; share of the excess that is gone


def incomplete(verdict: Verdict, told: str, left: Leftover | None = None) -> Verdict:
    """Something remains that the explanation does not hold, as is told: it is not put into the
    machine.
    """
    beside = f"beside {verdict.entry.hypothesis.label}, " if verdict.entry else ""
    return Verdict("unexplained", None, reason=beside + told, refuted=verdict.entry, left=left)


def still_loud(verdict: Verdict, proof: Proof) -> Verdict:
    """A cause that leaves far more than noise of the data kept back is not the whole of it, unless
    next to all that was above the noise is gone: of much, a form that is not quite its own leaves
    more than noise.
    """
    before, after = (proof.pooled(state, "holdout") for state in ("retuned", "explained"))
    if verdict.word != "explained" or not after > LOUD or excess_removed(before, after, 1.0) > MOST:
        return verdict
    told = f"the mismatch of the data kept back is still {after:.1f} times the noise"
    return incomplete(verdict, told)


def misplaced(verdict: Verdict, found: Sequence[Site], spent: bool = False) -> Verdict:
    """A cause that explains less than simple laws at another place do is none, nor is nothing; at
    its own place they must explain as much more as a free-form law that would win, and nothing
    there speaks against one that is ``spent``: of what it leaves, nothing gains.
    """
    gain = verdict.entry.gain if verdict.entry else 0.0
    if verdict.word == "unexplained":
        return verdict
    if verdict.word == "nothing_missing":
        other = next((s for s in found[:1] if s.gain > LEAST), None)
    else:
        other = elsewhere(found, verdict.places, gain)
        if other is None and verdict.entry is not None and not spent:
            other = _better(found, verdict.entry)
    if other is None:
        return verdict
    entry = verdict.entry
    beside = f"{entry.hypothesis.label} explains less than" if entry else "the rest is explained by"
    reason = f"{beside} simple laws at {other.location} ({other.word}, {other.gain:.0f} nats)"
    return Verdict("unexplained", None, reason=reason, refuted=verdict.entry)


def _better(found: Sequence[Site], entry: Entry) -> Site | None:
    """The best site, if its laws explain more than a cause there may leave to another form."""
    share = FAMILY if len(entry.hypothesis.key) == 1 else 1.0
    return next((s for s in found[:1] if s.gain > share * entry.gain + THRESHOLD), None)


def unfinished(verdict: Verdict, beside: Sequence[Site], floor: float = 0.0) -> Verdict:
    """A cause beside which simple laws at some place gain much, more than a wrong shape of smooth
    friction fakes (``floor`` [nats]), is not the whole of it.
    """
    gain = verdict.entry.gain if verdict.entry else 0.0
    left = remaining(beside, gain) if verdict.word in ("explained", "ambiguous") else None
    if left is None or left.gain < floor:
        return verdict
    return incomplete(verdict, f"simple laws at {left.location} ({left.word}) still explain part")


def with_curve(verdict: Verdict, competition: Competition) -> Verdict:
    """In place of a refuted cause the best free-form law, if it explains half as much at least."""
    if verdict.word != "unexplained" or verdict.entry is not None or verdict.refuted is None:
        return verdict
    laws = [e for e in competition.entries if e.hypothesis.law]
    law = max(laws, key=lambda e: e.gain, default=None)
    if law is None or law.gain < max(HALF * verdict.refuted.gain, THRESHOLD):
        return verdict
    return replace(verdict, entry=law)
