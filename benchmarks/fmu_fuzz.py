"""Random sequences of calls with good and bad values against the standard's state machine.

    python -m benchmarks.fmu_fuzz [--flavour native] [--sequences 10000] [--seed 0]

walks instances of an FMU through every function in any order.  What the standard allows
must be done, what it does not must be refused with a sentence and change nothing, no value that was
given as good may be infinite or NaN, and a saved state must go on bit for bit.  A crash or a
sequence longer than a minute ends the process.  Writes benchmarks/results/fmu_fuzz.json.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.fmu_host import Library
from benchmarks.fmu_judge import DISCARD, ERROR, OK, Actor, WrongError
from benchmarks.fmu_walk import Walk
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.session import unpacked

RESULT = Path(__file__).parent / "results" / "fmu_fuzz.json"
LONGEST = 60.0  # [s] of a sequence


class Survival(Walk):
    """The pythonfmu flavour knows few ways to say no: its host must live, and no call be fatal."""

    soundness = 0.97  # after a failure each step is refused

    def judge(self, actor: Actor, call: Callable[[], int], good: bool, maybe: bool = False) -> int:
        """Status of a call; what was refused shows at the next step."""
        status = call()
        if status not in (OK, DISCARD, ERROR):
            raise WrongError(f"status {status}")
        self.counts["refused"] += status != OK
        return status

    def finite(self, values: list[float], actor: Actor) -> None:
        """It gives NaN for what it refuses."""

    def must(self, holds: bool, words: str) -> None:
        """As above."""


WALKS = {"native": Walk, "python": Survival}


def walk(
    library: Library, sequences: int, seed: int, flavour: str = "native", calls: int = 60
) -> dict[str, Any]:
    """Counts of some sequences, and what was wrong."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    slowest = 0.0
    for n in range(seed, seed + sequences):
        faulthandler.dump_traceback_later(LONGEST, exit=True)
        begun = time.perf_counter()
        try:
            WALKS[flavour](library, n, counts).run(calls)
        except WrongError as error:
            wrong.append(str(error))
        slowest = max(slowest, time.perf_counter() - begun)
    faulthandler.cancel_dump_traceback_later()
    return {"sequences": sequences, "seed": seed, **counts, "slowest_s": slowest, "wrong": wrong}


def main() -> None:
    """Walk, print and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sequences", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--flavour", choices=WALKS, default="native")
    parser.add_argument("--print", action="store_true", help="write no file")
    words = parser.parse_args()
    begun = time.perf_counter()
    with (
        tempfile.TemporaryDirectory() as folder,
        unpacked(build_fmu(Path(folder), None, words.flavour)) as place,
    ):
        result = walk(Library(place), words.sequences, words.seed, words.flavour)
    seconds = time.perf_counter() - begun
    commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    command = (
        f"python -m benchmarks.fmu_fuzz --flavour {words.flavour} --sequences {words.sequences} "
        f"--seed {words.seed}"
    )
    document = {"command": command, "commit": commit.strip(), "seconds": seconds, **result}
    print(json.dumps(document, indent=1))
    if not words.print:
        keep(words.flavour, document)


def keep(flavour: str, document: dict[str, Any]) -> None:
    """Put a flavour's result beside the other's."""
    known = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.exists() else {}
    text = json.dumps({**known, flavour: document}, indent=1)
    RESULT.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
