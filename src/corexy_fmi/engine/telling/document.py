"""diagnosis.json (CONTRACT 4) out of a verdict, its fits and its proof."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape, law_values
from corexy_fmi.engine.fitting.noise import quick_noise
from corexy_fmi.engine.judging import locate
from corexy_fmi.engine.judging.model import (
    Ends,
    covariance,
    effect_table,
    law_table,
    retuned_table,
    upper_bound,
)
from corexy_fmi.engine.judging.prove import Proof, Replay
from corexy_fmi.engine.judging.verdict import Verdict, excess_removed
from corexy_fmi.engine.naming.entries import THRESHOLD, Competition, told
from corexy_fmi.engine.naming.screen import Lead
from corexy_fmi.engine.telling.words import in_words, shape
from corexy_fmi.kernel.layout import Instance
from corexy_fmi.machine import Machine
from corexy_fmi.topology import STAGES

ARGUMENT_STATE = {
    "vx": "speed",
    "vy": "speed",
    "x": "position",
    "y": "position",
    "phi1": "motor_angle",
    "phi2": "motor_angle",
    "t": "time",
}
COORDINATE_OF = {c: c[-1] for c in ("x", "y", "vx", "vy", "ax", "ay")} | {
    f"phi{n}_meas": f"motor{n}" for n in (1, 2)
}
Further = Sequence[Mapping[str, Ends]]
NEAREST = 3  # sets of the catalogue that an unexplained mismatch is told beside
INTERPOLATED = r"\mathrm{interp}(a;\ \mathrm{knots}, \mathrm{values})"
LAW_EQUATIONS = {"force": f"F = {INTERPOLATED}", "friction": f"f = f_C + {INTERPOLATED}"}


def _member(key: tuple[str, str]) -> dict[str, str]:
    return {"name": key[0], "location": key[1]}


def _alternatives(
    competition: Competition, verdict: Verdict, member: tuple[str, str]
) -> list[dict[str, Any]]:
    """What else could stand in a member's place, with its probability."""
    own = set(verdict.entry.hypothesis.key) if verdict.entry else set()
    rest = own - {member}
    shares: dict[tuple[str, str], float] = {}
    for entry, chance in zip(competition.entries, competition.probability, strict=True):
        others = set(entry.hypothesis.key) - rest
        if member not in others and len(others) == 1 and chance > 1e-4:
            key = others.pop()
            shares[key] = shares.get(key, 0.0) + chance
    ranked = sorted(shares.items(), key=lambda item: -item[1])[:5]
    return [_member(key) | {"probability": chance} for key, chance in ranked]


def _effect(
    instance: Instance, fit: Fit, competition: Competition, verdict: Verdict, further: Further
) -> dict[str, Any]:
    effect, key = instance.effect, (instance.effect.name, instance.location)
    entry = _member(key) | {
        "probability": competition.share(key),
        "parameters": effect_table(fit, *key, covariance(fit), further),
        "alternatives": _alternatives(competition, verdict, key),
        "equation": effect.equation,
        "citation": effect.citation,
        "remedy": effect.remedy,
        "check": effect.check,
    }
    return entry | ({"size_is_sure": False} if verdict.unsized else {})


def whereabouts(verdict: Verdict, proof: Proof) -> tuple[str, str | None]:
    """Coordinate and state of the mismatch: where simple laws explain most of what no effect does;
    else what a winner left over points at, if that is most of it; else those of the verdict's
    entry, or of the one that was refuted; else the coordinate whose channel shows most.
    """
    if verdict.site is not None:
        return verdict.site.location, verdict.site.state
    held = verdict.refuted.gain if verdict.refuted else 0.0
    if verdict.left is not None and verdict.left.gain > held:
        return verdict.left.place
    entry = verdict.entry or verdict.refuted
    if entry is not None:
        return _place(entry.hypothesis)
    sizes = {
        samples.channel: replayed.rms(c) / quick_noise(samples)
        for replayed in proof.replays["retuned"]
        for c, samples in enumerate(replayed.run.samples)
    }
    return COORDINATE_OF[max(sizes, key=lambda name: sizes[name])], None


def _free_forms(
    fit: Fit, competition: Competition, verdict: Verdict, proof: Proof
) -> list[dict[str, Any]]:
    """An entry for each law, the first with all that is to be said of the mismatch; one without
    where there is no law.
    """
    first, *beside = fit.problem.hypothesis.laws or (None,)
    told = _free_form(first, fit, competition, verdict, proof)
    return [told, *({**told, **_own(law, fit), "description": shape(fit, law)} for law in beside)]


def _free_form(
    law: LawShape | None, fit: Fit, competition: Competition, verdict: Verdict, proof: Proof
) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "name": "free_form",
        "location": law.location if law else whereabouts(verdict, proof)[0],
        "probability": told(competition.probability[0]) if competition.entries else 0.0,
        "parameters": {},
        "alternatives": [],
        "equation": LAW_EQUATIONS[law.acts if law else "force"],
        "citation": "",
        "remedy": "",
        "check": "",
        "description": in_words(fit, competition, verdict, proof),
    }
    return entry | _own(law, fit) if law else entry


def _own(law: LawShape, fit: Fit) -> dict[str, Any]:
    """What an entry holds of one law."""
    values = law_values(fit, law).tolist()
    acts = {} if law.acts == "force" else {"acts": law.acts}
    where = {"location": law.location, "argument": law.argument}
    more = {"parameters": law_table(fit, law, covariance(fit))}
    return where | {"knots": list(law.knots), "values": values} | acts | more


def effects(
    verdict: Verdict, fit: Fit, competition: Competition, proof: Proof, further: Further = ()
) -> list[dict[str, Any]]:
    """The ``effects`` of the document; for ``unexplained`` the free-form laws; ``further``:
    `effect_table`.
    """
    if verdict.word == "unexplained":
        return _free_forms(fit, competition, verdict, proof)
    if verdict.entry is None or verdict.word == "nothing_missing":
        return []
    return [_effect(i, fit, competition, verdict, further) for i in verdict.entry.hypothesis.uses]


def nearest(verdict: Verdict, competition: Competition) -> list[dict[str, Any]]:
    """What the catalogue offers where it does not explain: its best sets, each with the share of
    the best entry's gain, and the parameters of their fits.
    """
    if verdict.word != "unexplained" or not competition.entries:
        return []
    most = max(competition.entries[0].gain, 1e-9)
    named = [e for e in competition.entries if e.hypothesis.uses and e.gain > THRESHOLD][:NEAREST]
    return [
        {
            "gain_share": float(entry.gain / most),
            "effects": [
                _member((i.effect.name, i.location))
                | {
                    "parameters": effect_table(
                        entry.fit, i.effect.name, i.location, covariance(entry.fit)
                    )
                }
                for i in entry.hypothesis.uses
            ],
            "retuned": retuned_table(entry.fit, covariance(entry.fit)),
        }
        for entry in named
    ]


def located(
    verdict: Verdict, competition: Competition, proof: Proof, machine: Machine
) -> dict[str, Any]:
    """Where the mismatch lies: coordinate, state, time, path, band."""
    if verdict.word == "nothing_missing":
        return {
            "coordinate": None,
            "state": None,
            "time": [],
            "path": [],
            "frequency": [0.0, 0.0],
            "confidence": 0.0,
            "sites": [],
        }
    coordinate, state = whereabouts(verdict, proof)
    chance = verdict.site.probability if verdict.site else _chance(competition, coordinate)
    return {
        "coordinate": coordinate,
        "state": state,
        "time": locate.windows(proof),
        "path": locate.places(proof, STAGES[machine.stage], machine.parameters["pulley_radius"]),
        "frequency": locate.band(proof),
        "confidence": float(min(chance, 1.0)),
        "sites": [asdict(site) for site in verdict.sites],
    }


def _chance(competition: Competition, coordinate: str) -> float:
    """Probability of all entries at a coordinate."""
    pairs = zip(competition.entries, competition.probability, strict=True)
    return sum(p for e, p in pairs if _place(e.hypothesis)[0] == coordinate)


def _place(hypothesis: Any) -> tuple[str, str]:
    law = hypothesis.law
    state = ARGUMENT_STATE[law.argument] if law else hypothesis.uses[0].effect.state
    return hypothesis.places[0], state


def fit_rows(proof: Proof) -> list[dict[str, Any]]:
    """One row for each recording and channel."""
    rows = []
    for r, run in enumerate(proof.runs):
        replays: Mapping[str, Replay] = {state: proof.replays[state][r] for state in proof.replays}
        for c, samples in enumerate(run.samples):
            rows.append(
                {
                    "recording": run.name,
                    "role": run.role,
                    "channel": samples.channel,
                    "noise_std": proof.noise_std[r][c],
                    **{f"rms_{s}": replays[s].rms(c) for s in replays},
                    "whiteness_p": whiteness(replays["explained"], c),
                }
            )
    return rows


def whiteness(replayed: Replay, channel: int) -> float:
    """Ljung-Box p-value of the first ten lags of a channel's whitened errors."""
    from scipy.stats import chi2

    sizes = [len(s.index) for s in replayed.run.samples]
    first = sum(sizes[:channel])
    e = replayed.fit.residual[first : first + sizes[channel]]
    n, power = len(e), float(e @ e) or 1.0
    q = sum((float(e[k:] @ e[:-k]) / power) ** 2 / (n - k) for k in range(1, 11))
    return float(chi2.sf(n * (n + 2) * q, 10))


def heldout(rows: list[dict[str, Any]], weak: bool) -> dict[str, Any]:
    """Pooled rms of the held-out x and y (else of all held-out channels)."""
    judged = [r for r in rows if r["role"] == "holdout"]
    chosen = [r for r in judged if r["channel"] in ("x", "y")] or judged
    if not chosen:
        return {
            "rms_nominal": None,
            "rms_retuned": None,
            "rms_explained": None,
            "noise_std": None,
            "excess_removed": None,
            "weak": True,
        }
    keys = ("rms_nominal", "rms_retuned", "rms_explained", "noise_std")
    pooled = {k: float((sum(r[k] ** 2 for r in chosen) / len(chosen)) ** 0.5) for k in keys}
    share = excess_removed(pooled["rms_retuned"], pooled["rms_explained"], pooled["noise_std"])
    return pooled | {"excess_removed": float(share), "weak": weak}


def not_excluded(leads: list[Lead], named: set[tuple[str, str]]) -> list[dict[str, Any]]:
    """Upper bounds of every effect and place that was not named."""
    rows = [upper_bound(lead) for lead in leads]
    return [row for row in rows if (row["name"], row["location"]) not in named]


def retuned(fit: Fit) -> dict[str, dict[str, object]]:
    """The nominal parameters of a fit."""
    return retuned_table(fit, covariance(fit))
