"""How far places, probabilities and intervals of the proof's diagnoses can be trusted.

Every function takes the outcomes of the proof (lines of ``proof*.jsonl``); only cases with one
planted effect count.
"""

from __future__ import annotations

from typing import Any

from scipy.stats import binomtest

from benchmarks.concealed.fold import folded
from corexy_fmi.effects import catalogue

Entry = dict[str, Any]
SEEN = 300.0  # least E of a case whose place is judged
BINS = ((0.0, 0.5), (0.5, 0.9), (0.9, 0.99), (0.99, 1.0))  # of probability
PERIOD = 6.283185307179586  # [rad] of a phase
COUNTED_DOWN = "steps"  # the plant counts steps that are missing, the catalogue those of the jump
CREPT = ("belt_relaxation", "ratio")
# the plant's laws that are the catalogue's own, where it has another that is not
OWN_LAWS = {
    "stribeck_friction": (0, 2),
    "presliding_hysteresis": (0,),
    "friction_vs_position": (0,),
    "load_friction": (0, 1),
    "quadratic_drag": (0,),
    "friction_warmup": (0,),
    "belt_slack": (0,),
    "belt_damping": (0,),
    "belt_hardening": (0,),
    "belt_relaxation": (0,),
    "microstep_error": (0,),
    "missed_steps": (0,),
    "winding_lag": (0,),
    "torque_ripple": (1,),
    "cable_drag": (0,),
    "sensor_lag": (0,),
}


def rate(hits: int, n: int) -> str:
    """``hits/n = share [Wilson 95 %]``."""
    if not n:
        return "no case"
    interval = binomtest(hits, n).proportion_ci(method="wilson")
    return (
        f"{hits}/{n} = {100 * hits / n:.1f} % [{100 * interval.low:.1f}, {100 * interval.high:.1f}]"
    )


def single(entries: list[Entry]) -> list[Entry]:
    """The cases with one planted effect."""
    return [e for e in entries if e["truth"]["kind"] == "effect"]


def located(entries: list[Entry]) -> tuple[int, int, int]:
    """Cases of E >= 300: how many, with the right coordinate, with the right variable."""
    cases = [e for e in single(entries) if e["truth"]["E"] >= SEEN]
    place = sum(place_right(e["truth"], e["document"]["located"]["coordinate"]) for e in cases)
    state = sum(
        e["document"]["located"]["state"] == catalogue()[e["truth"]["effects"][0]["name"]].state
        for e in cases
    )
    return len(cases), place, state


def place_right(truth: dict[str, Any], said: str | None) -> bool:
    """Whether a coordinate is where the (first) effect was planted, or a part of that."""
    planted = truth["effects"][0]["location"]
    parts = {"xy": ("x", "y"), "motors": ("motor1", "motor2")}
    return said is not None and said in (planted, *parts.get(planted, ()))


def named(entries: list[Entry]) -> list[tuple[float, bool]]:
    """Probability of each leading named effect, and whether the case was named rightly."""
    found = []
    for e in single(entries):
        effects = e["document"]["effects"]
        if effects and effects[0].get("probability") is not None:
            leads = effects[0]["name"] != "free_form"
            found += [(float(effects[0]["probability"]), _leads_right(e))] * leads
    return found


def _leads_right(entry: Entry) -> bool:
    planted, said = entry["truth"]["effects"][0], entry["document"]["effects"]
    return {(e["name"], e["location"]) for e in said} == {(planted["name"], planted["location"])}


def brier(pairs: list[tuple[float, bool]]) -> float:
    """Mean squared difference between probability and outcome; 0 is perfect."""
    return sum((p - right) ** 2 for p, right in pairs) / len(pairs) if pairs else float("nan")


def in_own_form(entry: Entry) -> bool:
    """Whether a case's one effect acts by a law that the catalogue has."""
    planted = entry["truth"]["effects"][0]
    form = planted.get("form", {})
    laws = OWN_LAWS.get(planted["name"])
    return (laws is None or form.get("law", 0) in laws) and not form.get("duty")


def coverage(entries: list[Entry]) -> dict[tuple[str, str], list[bool]]:
    """Whether the 95 % interval of each parameter of a rightly named effect holds the truth."""
    found: dict[tuple[str, str], list[bool]] = {}
    for e in (e for e in single(entries) if e["outcome"] == "right"):
        planted = e["truth"]["effects"][0]
        for said in e["document"]["effects"]:
            for name, value in said["parameters"].items():
                if name in planted["parameters"]:
                    truth = as_catalogued(planted, name, said["parameters"])
                    inside = inside_of(name, value, truth)
                    found.setdefault((planted["name"], name), []).append(inside)
    return found


def as_catalogued(planted: dict[str, Any], name: str, said: dict[str, Any]) -> float:
    """A planted value by the definition of what is ``said``, where CONTRACT 5 leaves that open.

    The plant's creeping arm is stiff by a ratio of the relaxed belt, the catalogue's by a share of
    what a quick load meets.  The plant's pulses are twice their amplitude high, their middle
    where its sine is largest, the catalogue's (``duty`` among what is said) are as high and
    begin at a phase of zero.
    """
    truth: float = planted["parameters"][name]
    if name.startswith(COUNTED_DOWN):
        return -truth
    duty = planted.get("form", {}).get("duty")
    if duty and "duty" in said:
        if name.startswith("phase"):
            return truth + PERIOD * (duty / 2 - 1 / 4)
        return 2 * truth if name == "amplitude" else truth
    return truth / (1 + truth) if (planted["name"], name) == CREPT else truth


def inside_of(name: str, said: dict[str, Any], truth: float) -> bool:
    low, high = said["ci95"]
    turns = (-PERIOD, 0.0, PERIOD) if name.startswith("phase") else (0.0,)
    return any(low <= truth + turn <= high for turn in turns)


def section(entries: list[Entry], latest: list[Entry] | None = None) -> list[str]:
    """The part of RESULTS.md; intervals of the ``latest`` cases beside those of all."""
    n, place, state = located(entries)
    lines = ["### Places, probabilities, intervals", ""]
    lines += [f"One effect, E >= 300: right coordinate {rate(place, n)} (aim 98 %), right variable"]
    lines += [
        f"{rate(state, n)} (aim 85 %).",
        "",
        *_reliability(entries),
        "",
        *_intervals(entries, latest),
    ]
    return [*lines, ""]


def _reliability(entries: list[Entry]) -> list[str]:
    pairs = named(entries)
    lines = [
        f"Brier score of the leading named effect: {brier(pairs):.3f} over {len(pairs)} cases.",
        "",
    ]
    lines += ["| probability said | cases | right [Wilson 95 %] |", "|---|---|---|"]
    for low, high in BINS:
        inside = [right for p, right in pairs if low < min(p, 1.0) <= high]
        lines.append(f"| {low} .. {high} | {len(inside)} | {rate(sum(inside), len(inside))} |")
    return lines


def _intervals(entries: list[Entry], latest: list[Entry] | None) -> list[str]:
    found, own = _covered(entries)
    late = [_pooled(group) for group in _covered(latest or [])]
    told = f" Of the latest {len(latest)} cases: {late[0]}, and {late[1]}." if latest else ""
    lines = [
        "95 % intervals of rightly named effects hold the truth (aim 93 to 97 %): "
        f"{_pooled(found)};",
        f"where the plant's law has the catalogue's form: {_pooled(own)}.{told}",
        "",
    ]
    table = ["| effect | parameter | inside | in the catalogue's form |", "|---|---|---|---|"]
    rows = ((e, p, v, own.get((e, p), [])) for (e, p), v in sorted(found.items()))
    table += [f"| {e} | {p} | {_of(v)} | {_of(o)} |" for e, p, v, o in rows]
    return lines + folded(f"{len(found)} parameters one by one", table)


def _covered(entries: list[Entry]) -> list[dict[tuple[str, str], list[bool]]]:
    """The coverage of all cases, and of those in the catalogue's form."""
    return [coverage(some) for some in (entries, [e for e in single(entries) if in_own_form(e)])]


def _pooled(found: dict[tuple[str, str], list[bool]]) -> str:
    every = [inside for group in found.values() for inside in group]
    return rate(sum(every), len(every))


def _of(inside: list[bool]) -> str:
    return f"{sum(inside)}/{len(inside)}" if inside else "-"
