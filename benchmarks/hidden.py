"""Known changes hidden in real recordings: does the program find them, and only them?

    python -m benchmarks.hidden [--minutes N] [--only NAME] [--round N] [--render]

For each recording: what is named on it untouched is the baseline.  Then each edit is drawn, sealed
by hash, hidden in it, diagnosed, and the seal opened.  Success is the baseline with the hidden
effect; a sham (noise only) that changes the set is a false alarm.  Cases done stay in
benchmarks/results/hidden.jsonl, so that a run can be cut short and gone on with; a later engine
begins another round.  The recordings lie beside the checkout (../shared/data).
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from benchmarks import emps, voron
from benchmarks.case import PAGES, ROOT
from benchmarks.concealed.cases import seed_of
from benchmarks.hidden_edits import EDITS, hidden, truth_of
from benchmarks.hidden_page import rendered, told
from benchmarks.outcome import RESULTS, commit
from corexy_fmi.engine import diagnose
from corexy_fmi.machine import Machine, load_machine
from corexy_fmi.recording import Recording
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.recording.klipper import Move, import_klipper

STORE = RESULTS / "hidden.jsonl"
PAGE = PAGES / "hidden.md"
ORIGIN = "8d509a2c"  # what the seeds follow from: a commit from before these cases
UNTOUCHED = "untouched"
ENDS = {"x.csv": ((-0.025, 0.0), (0.025, 0.0)), "y.csv": ((0.0, -0.025), (0.0, 0.025))}


@dataclass(frozen=True)
class Host:
    """A real recording to hide something in: how it is read, its machine, the edits that fit it."""

    name: str
    read: Callable[[], Recording]
    machine: Callable[[], Machine]
    edits: tuple[str, ...]
    spans: dict[str, tuple[float, float]]


def _voron(name: str) -> Recording:
    source, _ = voron.MOVES[name]
    radius = load_machine(voron.MACHINE).parameters["pulley_radius"]
    move = Move(*ENDS[name], 0.1, 6.0, -0.0008)
    return replace(import_klipper(voron.DATA / source, move, "-z,+y", radius), name=name)


def _pulses() -> Recording:
    """EMPS with its pulses, as a log whose zero and clock are its own."""
    about = {k: v for k, v in emps.ABOUT.items() if k != "zero"}
    return import_columns(emps.DATA / "DATA_EMPS_PULSES.mat", emps.CLOSED, about, 1.0)


@cache
def _fitted() -> Machine:
    """EMPS as the diagnosis of its untouched recording left it (docs/cases/emps.md)."""
    stored = json.loads((RESULTS / "emps.json").read_text(encoding="utf-8"))
    return emps.fitted(stored["runs"]["DATA_EMPS"])


PRINTER = ("late samples", "turned sensor", "scaled x", "sham 1", "shaper", "stretched clock",
           "sham 2")  # fmt: skip
ALONG_Y = tuple(name for name in PRINTER if name != "scaled x")
AXIS = ("late samples", "sham 1", "stretched clock")
HOSTS = (
    Host("voron x", lambda: _voron("x.csv"), lambda: load_machine(voron.MACHINE), PRINTER, {}),
    Host("voron y", lambda: _voron("y.csv"), lambda: load_machine(voron.MACHINE), ALONG_Y, {}),
    Host("emps pulses", _pulses, _fitted, AXIS, {"stretched clock": (2e-4, 1e-3)}),
)


def seal(truth: dict[str, Any]) -> tuple[str, bytes]:
    """SHA-256 of salt and truth, and those bytes, to be opened later."""
    text = json.dumps(truth, sort_keys=True, separators=(",", ":"))
    sealed = os.urandom(16).hex().encode() + text.encode()
    return hashlib.sha256(sealed).hexdigest(), sealed


def run(host: Host, edit: str, turn: int) -> dict[str, Any]:
    """Hide, seal, diagnose, open."""
    recording, truth, mark, sealed = host.read(), {}, "", b""
    if edit != UNTOUCHED:
        seed = seed_of(ORIGIN, f"{host.name}:{edit}")
        truth = truth_of(EDITS[edit], seed, host.spans.get(edit))
        mark, sealed = seal(truth)
        _append({"host": host.name, "edit": edit, "round": turn, "seal": mark})
        recording = hidden(recording, truth)
    begun = time.monotonic()
    document = diagnose([recording], [], host.machine(), jobs=1).document
    opened = json.loads(sealed[32:]) if sealed else {}
    assert hashlib.sha256(sealed).hexdigest() == mark or not sealed
    seconds = time.monotonic() - begun
    return {"host": host.name, "edit": edit, "round": turn, "seal": mark, "truth": opened,
            "told": told(document), "seconds": seconds, "commit": commit()}  # fmt: skip


def _append(entry: dict[str, Any]) -> None:
    with STORE.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry, sort_keys=True) + "\n")


def stored() -> list[dict[str, Any]]:
    """Cases that were opened."""
    if not STORE.is_file():
        return []
    entries = [json.loads(line) for line in STORE.read_text(encoding="utf-8").splitlines()]
    return [{"round": 1} | entry for entry in entries if "told" in entry]


def main() -> None:
    """Run the cases that are not there yet, and render."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this long")
    parser.add_argument("--only", default="", help="only this recording")
    parser.add_argument("--render", action="store_true", help="the page from the stored cases")
    parser.add_argument("--round", type=int, help="of all cases; default: the newest")
    given = parser.parse_args()
    turn = given.round or max((e["round"] for e in stored()), default=1)
    begun = time.monotonic()
    done = {(e["host"], e["edit"]) for e in stored() if e["round"] == turn}
    for host in () if given.render else HOSTS:
        for edit in (UNTOUCHED, *host.edits):
            late = time.monotonic() - begun > 60 * given.minutes
            if late or (host.name, edit) in done or given.only not in ("", host.name):
                continue
            if not (voron.DATA.is_dir() and emps.DATA.is_dir()):
                sys.exit(f"{voron.DATA.parent}: no recordings of voron_ringdown and emps there")
            _append(entry := run(host, edit, turn))
            print(host.name, edit, entry["told"]["verdict"], f"{entry['seconds']:.0f} s")
    PAGE.write_text(rendered(stored()), encoding="utf-8")
    print(PAGE.relative_to(ROOT))


if __name__ == "__main__":
    main()
