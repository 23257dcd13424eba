"""`python -m benchmarks.rivals [--cases NAME ...] [--render]`: all ways on the same files.

Needs the extra `rivals`.  Results go to benchmarks/results/rivals.json, the page to docs/rivals.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.concealed.proof import commit, kept_of
from benchmarks.mechanism.store import keep, read
from benchmarks.rivals.cases import BUNDLED, Given, given
from benchmarks.rivals.page import page

RESULTS, PAGE = Path("benchmarks/results/rivals.json"), Path("docs/rivals.md")
CASES = (*BUNDLED, "play-0", "yaw-0")


def ours(case: Given) -> dict[str, Any]:
    """The engine's answer: of the sealed run where that has it, else now."""
    from corexy_fmi.engine import diagnose

    known = case.known
    if known is None:
        known = {"document": kept_of(diagnose(*case.files, jobs=2)), "commit": commit()}
    document = known["document"]
    return {
        "rms": document["heldout"]["rms_explained"],
        "named": sorted({e["name"] for e in document["effects"]}),
        "terms": [f"{e['name']} at {e['location']}" for e in document["effects"]],
        "setting": document["verdict"],
        "commit": known["commit"],
    }


def ways(case: Given) -> dict[str, Any]:
    """Every way's held-out rms [m] and what it names."""
    from benchmarks.rivals.black_box import black_boxes
    from benchmarks.rivals.common import ground
    from benchmarks.rivals.discrepancy import discrepancy
    from benchmarks.rivals.responses import responses

    base, seconds = timed(lambda: ground(*case.files))
    found = {
        "nothing": {"rms": base.given, "named": [], "seconds": 0.0},
        "plain retuning": {"rms": base.retuned, "named": [], "seconds": seconds},
    }
    for several in (
        lambda: {"SINDy on responses": responses(base)},
        lambda: black_boxes(base),
        lambda: discrepancy(base),
    ):
        result, seconds = timed(several)
        found |= {k: v | {"seconds": seconds / len(result)} for k, v in result.items()}
    return found


def timed(function: Callable[[], Any]) -> tuple[Any, float]:
    """What a function gives, and how long it took [s]."""
    begun = time.monotonic()
    return function(), time.monotonic() - begun


def main() -> None:
    """Run the cases and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", nargs="*", default=CASES, help="names; default: all")
    parser.add_argument("--render", action="store_true", help="only the page")
    parser.add_argument("--only", choices=("ours", "rivals"), help="keep the other's answers")
    arguments = parser.parse_args()
    for name in () if arguments.render else arguments.cases:
        case = given(name)
        entry = read(RESULTS).get(name, {}) | {
            "cause": case.cause, "noise": case.truth["noise"]["sigma"],
        }  # fmt: skip
        if arguments.only != "ours":
            entry |= {"ways": ways(case), "commit": commit()}
        if arguments.only != "rivals":
            entry["ours"] = ours(case)
        keep(name, entry, RESULTS)
        for way, result in entry["ways"].items():
            print(
                f"{name:12s} {way:24s} {1e6 * result['rms']:8.2f} um  {result['named']}", flush=True
            )
    PAGE.write_text(page(read(RESULTS)), encoding="utf-8")


if __name__ == "__main__":
    main()
