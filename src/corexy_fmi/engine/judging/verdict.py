"""The verdict: what the competition and the held-out data allow to be said (CONTRACT 4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from corexy_fmi.engine.judging.prove import Proof
from corexy_fmi.engine.naming.entries import THRESHOLD, Competition, Entry
from corexy_fmi.engine.naming.specification import Leftover
from corexy_fmi.engine.places.site import HALF, Site

SURE = 0.95
AGREES = 1.1  # rms over noise
CONFIRMED = 2.0  # [nats] of held-out gain that a small effect must show
MUTE = 6.0  # [nats] of contrast d up to which its scatter, sqrt(2 d), is most of a gain
SURPRISE = 3.0  # deviations, sqrt(2 d), that the right cause's gain may lie below d
SCATTER = 4.0  # [nats] by which predictive fits of replays that are alike may end apart
WORSE = 1.02  # of the retuned machine's held-out rms; right causes came to 1.004 at most
WEAK_GAIN = 40.0  # [nats] below which an unconfirmed effect is a false alarm
CLASS_SHARE = 0.02  # members of a class have at least this share of the best one's probability


@dataclass(frozen=True, eq=False)
class Verdict:
    """The word, the entry it stands on, the classes of equals, what shows that it is so, the winner
    that was refuted, what that left over, what the fit that stands leaves, and where simple laws
    would explain the mismatch.  ``unseen``: data kept back hardly show the entry; ``unsized``: they
    show it, of another size.
    """

    word: str
    entry: Entry | None
    classes: tuple[tuple[tuple[tuple[str, str], ...], ...], ...] = ()
    reason: str = ""
    refuted: Entry | None = None
    left: Leftover | None = None
    stands: Leftover | None = None
    sites: tuple[Site, ...] = ()
    unseen: bool = False
    unsized: bool = False

    @property
    def places(self) -> list[str]:
        """Where all that may be the cause acts: of the entry, and of its equals."""
        keys = [key for group in self.classes for key in group]
        own = self.entry.hypothesis.places if self.entry else []
        return [*own, *(location for key in keys for _, location in key)]

    @property
    def _causes(self) -> list[Entry]:
        return [e for e in (self.refuted, self.entry) if e is not None]

    @property
    def site(self) -> Site | None:
        """Where an unexplained mismatch lies, if simple laws there explain as much as a free-form
        law that stands does, or as half of what a cause does, or left over; where that law acts, if
        laws of no other place are surely better than those there.
        """
        known = [e.gain * (1.0 if e.hypothesis.law else HALF) for e in self._causes]
        least = max(THRESHOLD, HALF * self.left.gain if self.left else 0.0, *known)
        found = self.sites if self.word == "unexplained" else ()
        own = self.entry.hypothesis.places if self.entry and self.entry.hypothesis.law else []
        tied = [s for s in found if s.location in own and s.probability > 1 - SURE]
        return next((s for s in [*tied, *found[:1]] if s.gain > least), None)


def excess_removed(retuned: float, explained: float, noise: float) -> float:
    """(retuned^2 - explained^2) / (retuned^2 - noise^2), 0 where there is no excess."""
    excess = retuned**2 - noise**2
    return (retuned**2 - explained**2) / excess if excess > 1e-12 * retuned**2 else 0.0


def confirmed(proof: Proof) -> bool:
    """Whether held-out data agree: near the noise or half of the excess gone, and a gain on each
    recording that shows the effect at all.
    """
    near = _near(*_left(proof))
    return not proof.gains("holdout") or (near and harmless(proof) and _gains(proof))


def unsized(proof: Proof) -> bool:
    """Whether held-out data agree with the effect, of another size: as far as training lets its
    parameters move, and with what that costs.
    """
    near = _near(*(proof.within_training(state, "holdout") for state in ("retuned", "explained")))
    return near and _gains(proof) and not _contradicted(proof)


def _near(retuned: float, explained: float) -> bool:
    """Whether what is left [noise] is near the noise, or half of the excess is gone."""
    return explained <= AGREES or excess_removed(retuned, explained, 1.0) >= HALF


def _left(proof: Proof) -> tuple[float, float]:
    """What the retuned machine and the explained one leave of all held-out data [noise]."""
    return proof.pooled("retuned", "holdout"), proof.pooled("explained", "holdout")


def _gains(proof: Proof) -> bool:
    """Whether each held-out recording that shows the effect gains, and all of them enough; one in
    which the right cause's gain may be below nothing need not, if all gain half of what is due.
    """
    told = [(g, d) for g, d in _told(proof) if d > MUTE]
    gain, due = sum(g for g, _ in told), sum(d for _, d in told)
    as_due = gain > HALF * due
    return gain > CONFIRMED and all(g > (min(0.0, _least(d)) if as_due else 0.0) for g, d in told)


def _least(contrast: float) -> float:
    """What the right cause's gain may be as low as [nats], where a recording shows so little."""
    return contrast - SURPRISE * float(np.sqrt(2 * contrast))


def _contradicted(proof: Proof) -> bool:
    """Whether a held-out recording speaks against the explanation; where one does not show it, what
    its fits end apart by says nothing.
    """
    return not all(g > -(CONFIRMED if d > MUTE else SCATTER) for g, d in _told(proof))


def _told(proof: Proof) -> list[tuple[float, float]]:
    """Gain and contrast [nats] of each held-out recording."""
    return list(zip(proof.gains("holdout"), proof.contrasts("holdout"), strict=True))


def mute(proof: Proof) -> bool:
    """Whether no held-out recording shows the effect: with and without it they are simulated alike,
    within what noise decides.
    """
    contrasts = proof.contrasts("holdout")
    return bool(contrasts) and max(contrasts) <= MUTE and harmless(proof)


def harmless(proof: Proof) -> bool:
    """Whether held-out data do not speak against the explanation; enough for a free-form law."""
    retuned, explained = _left(proof)
    worse = explained > WORSE * retuned  # False where nothing is held out
    return not worse and not _contradicted(proof)


def slight(proof: Proof) -> bool:
    """Whether held-out data agree in all but how much they gain, which may be chance: each gains
    (CONTRACT 4 asks no more), and no less than the right cause might where they show it so little.
    """
    near = _near(*_left(proof))
    likely = all(g > max(0.0, _least(d)) for g, d in _told(proof) if d > MUTE)
    return near and harmless(proof) and likely


def rivals(competition: Competition, best: Entry) -> tuple[tuple[tuple[str, str], ...], ...]:
    """Keys of the entries that the data cannot tell from the best one."""
    shares = dict(
        zip((e.hypothesis.key for e in competition.entries), competition.probability, strict=True)
    )
    top = shares[best.hypothesis.key]
    near = [
        key for key, p in shares.items() if p >= CLASS_SHARE * top and key != best.hypothesis.key
    ]
    return (best.hypothesis.key, *near)


def decide(competition: Competition, proof: Proof | None, weak: bool = False) -> Verdict:
    """The verdict of a competition; held-out data may lower it, never choose.  ``weak``: they are
    the last parts of what was fitted.
    """
    best = competition.best
    if best is None:
        return _nothing_or_retuned(competition)
    agrees = proof is None or confirmed(proof)
    if best.hypothesis.law and (proof is None or harmless(proof)):
        return Verdict("unexplained", best)
    chance = dict(zip(map(id, competition.entries), competition.probability, strict=True))[id(best)]
    if not agrees and proof is not None and chance >= SURE and mute(proof):
        return _unseen(best, proof, weak)
    if not agrees and proof is not None and chance >= SURE and unsized(proof):
        return _unsized(best)
    if not agrees and proof is not None and chance >= SURE and slight(proof):
        return _beside_retuned(best)
    if not agrees and not (chance < SURE and _undisputed(best, proof)):
        return _refuted(best)
    if chance >= SURE:
        return Verdict("explained", best)
    return Verdict("ambiguous", best, (rivals(competition, best),))


def _unseen(best: Entry, proof: Proof, weak: bool) -> Verdict:
    """The recordings kept back cannot judge a sure cause: it stands if all of them gain, if only by
    chance; else beside retuned parameters, for a gain on every recording is asked (CONTRACT 4).
    Silent last parts of the same recordings confirm nothing.
    """
    if best.gain <= WEAK_GAIN:
        return _refuted(best)
    if not weak and all(gain > 0 for gain in proof.gains("holdout")):
        return Verdict("explained", best)
    return _beside_retuned(best)


def _beside_retuned(best: Entry) -> Verdict:
    """A sure cause that the recordings kept back hardly show stands beside retuned parameters."""
    if best.gain <= WEAK_GAIN:
        return _refuted(best)
    return Verdict("ambiguous", best, ((best.hypothesis.key, ()),), unseen=True)


def _unsized(best: Entry) -> Verdict:
    """A sure cause whose size training told too well or wrongly: it stands alone, but CONTRACT 4
    asks for less rms with what training told before it may be called the explanation.
    """
    if best.gain <= WEAK_GAIN:
        return _refuted(best)
    return Verdict("ambiguous", best, ((best.hypothesis.key,),), unsized=True)


def _undisputed(best: Entry, proof: Proof | None) -> bool:
    """Whether held-out data do not speak against any of several equals: they show little of it, or
    agree but for how much a recording gains.
    """
    if proof is None or best.gain <= WEAK_GAIN or not harmless(proof):
        return False
    return mute(proof) or unsized(proof) or _near(*_left(proof))


def _refuted(best: Entry) -> Verdict:
    """Held-out data contradict the winner: it is not put into the machine."""
    if best.gain <= WEAK_GAIN:
        return Verdict("nothing_missing", None)
    reason = f"{best.hypothesis.label} fits the data used, but not the data kept back"
    return Verdict("unexplained", None, reason=reason, refuted=best)


def _nothing_or_retuned(competition: Competition) -> Verdict:
    """Nothing pays; but where retuning went far, an effect that fits as well is named beside it."""
    fit = competition.retuned
    pulls = [abs(fit.u[k]) / x.prior_std for k, x in enumerate(fit.problem.unknowns)]
    close = [e for e in competition.entries if e.hypothesis.uses and e.gain > 0]
    if pulls and max(pulls) > 3 and close and close[0].gain > THRESHOLD / 2:
        return Verdict("ambiguous", close[0], ((close[0].hypothesis.key, ()),))
    return Verdict("nothing_missing", None)
