"""Tables of RESULTS.md: how far what was found is from the noise-free truth."""

from __future__ import annotations

from typing import Any

import numpy as np
from plant.world import ZEROED, stream

from benchmarks.concealed.fold import folded

Entry = dict[str, Any]
STRONG = 700.0  # planted at E = 1000; the real E scatters around it
SHOWN = 100.0  # of the squared error kept back: the effect shows there
MORE = 1.5  # times the E that a fit reaches: the plant's is overstated


def of(entries: list[Entry], kind: str) -> list[Entry]:
    """The entries of one kind."""
    return [e for e in entries if e["truth"]["kind"] == kind]


def misread(entry: Entry) -> bool:
    """Whether the distances to the truth that were kept are wrong: x, y had a known zero, and
    before ``zeroed`` was kept models were shifted onto what was measured all the same.
    """
    truth = entry["truth"]
    if "zeroed" in entry or truth.get("catalogue") != "full":
        return False
    pulled = any(e["name"] == "constant_force" for e in truth["effects"])
    return pulled or bool(stream(entry["seed"], "zero").random() < ZEROED)


def left_out(entries: list[Entry]) -> str:
    """A sentence on the cases whose distances are wrong; nothing where there are none."""
    count = sum(misread(e) for e in entries)
    told = (
        f" Left out: {count} older cases in which x and y have a known zero; models were shifted "
        "onto what was measured there, which hides a steady pull."
    )
    return told if count else ""


def removal(entries: list[Entry]) -> list[str]:
    """What is removed of the error kept back, as a sentence; nothing where it was not kept."""
    strong = [e for e in of(entries, "effect") if e["truth"]["E"] >= STRONG]
    right = [e for e in strong if e["outcome"] == "right"]
    shares = [e["removed"] for e in right if e.get("removed") is not None and not misread(e)]
    if not shares:
        return []
    return [
        "Removed of the error on data kept back, against the noise-free truth (E >= 1000, rightly "
        f"named, n = {len(shares)}): median {100 * np.median(shares):.1f} % (aim 98 %), worst "
        f"decile {100 * np.quantile(shares, 0.1):.1f} % (aim 90 %)."
        + _removed_of_all(right)
        + left_out(right),
        "",
    ]


def _removed_of_all(right: list[Entry]) -> str:
    """The same over all channels that are measured, where that was kept; and where much was left
    there to remove.
    """
    kept = [
        e["kept_back"]
        for e in right
        if e.get("kept_back", {}).get("retuned", 0.0) > 0.0 and not misread(e)
    ]
    if not kept:
        return ""
    told = (
        f" That is x and y alone. With all that is measured (motor angles with dc), each in its "
        f"noise (n = {len(kept)}, kept since): {_shares(kept)}."
    )
    shown = [d for d in kept if d["retuned"] >= SHOWN]
    return told + (
        f" Where retuning leaves {SHOWN:g} of its square or more, in noise units (n = "
        f"{len(shown)}): {_shares(shown)}; elsewhere what is kept back hardly shows the effect."
        if shown
        else ""
    )


def _shares(kept: list[dict[str, float]]) -> str:
    shares = [1.0 - d["explained"] / d["retuned"] for d in kept]
    median, worst = 100 * np.median(shares), 100 * np.quantile(shares, 0.1)
    return f"median {median:.1f} %, worst decile {worst:.1f} %"


def overstated(entries: list[Entry]) -> list[str]:
    """Where the plant's E is more than what a fit without the effect leaves of the truth, as a
    sentence; nothing where that was not kept.
    """
    kinds = ("effect", "pair")
    told = [e for e in entries if "reached" in e and e["truth"]["kind"] in kinds and not misread(e)]
    far = [e for e in told if _least(e) < e["truth"]["E"] / MORE]
    if not told:
        return []
    names = ", ".join(f"{e['name']} ({e['truth']['E']:.0f}: {_least(e):.0f})" for e in far)
    shown = [*folded("Which (E: reached)", [names]), ""] if far else []
    return [
        "E is a minimum, which the plant may miss: in "
        f"{len(far)} of {len(told)} cases a machine that was fitted here without all that was "
        f"planted comes {MORE:g} times nearer to the noise-free truth than that. No case is "
        f"counted otherwise for it.{left_out(entries)}",
        "",
        *shown,
    ]


def _least(entry: Entry) -> float:
    """Squared distance to the noise-free truth of what was fitted without all that was planted: the
    retuned machine, and that with some of a set.
    """
    said, planted = (
        {(e["name"], e["location"]) for e in effects}
        for effects in (entry["document"]["effects"], entry["truth"]["effects"])
    )
    some = bool(said) and said < planted
    return min(v for k, v in entry["reached"].items() if k == "retuned" or some)
