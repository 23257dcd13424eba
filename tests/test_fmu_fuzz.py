"""Random sequences of calls: a few here, ten thousand by `python -m benchmarks.fmu_fuzz`."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fmu_kit import template

from benchmarks import fmu_cost, fmu_fuzz
from benchmarks.fmu_host import Instance, Library
from benchmarks.fmu_judge import (
    ALLOWED,
    ENDED,
    FAILED,
    LOST,
    MADE,
    OPEN,
    RUNNING,
    WrongError,
)
from benchmarks.fmu_walk import Walk
from corexy_fmi.fmu.session import unpacked

ROOT = Path(__file__).parents[1]


def walked(sequences: int, flavour: str) -> dict[str, Any]:
    """In a process of its own: a crash or a hang would end it."""
    words = ["--sequences", str(sequences), "--seed", "1000000", "--flavour", flavour, "--print"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.fmu_fuzz", *words],
        cwd=ROOT, capture_output=True, text=True, timeout=100,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout)
    assert found["wrong"] == []
    return found


def test_random_walks_end_well() -> None:
    """What is allowed is done, what is not is refused, nothing unannounced."""
    found = walked(500, "native")
    assert found["steps"] > 1000
    assert found["refused"] > 2000
    assert found["repeated"] > 50


def test_the_python_flavour_survives_random_walks() -> None:
    """Its host lives, and no call ends as fatal."""
    found = walked(100, "python")
    assert found["steps"] > 0
    assert found["refused"] > 50


def test_ten_thousand_walks_are_kept() -> None:
    """The result of the long run; nothing was wrong."""
    kept = json.loads(fmu_fuzz.RESULT.read_text(encoding="utf-8"))
    for flavour, least in (("native", 10_000), ("python", 1_000)):
        assert kept[flavour]["sequences"] >= least
        assert kept[flavour]["wrong"] == []
        assert kept[flavour]["slowest_s"] < fmu_fuzz.LONGEST
    page = " ".join(fmu_cost.DOCUMENT.read_text(encoding="utf-8").split())
    assert f"10 000 walks of {kept['native']['calls']:,} calls".replace(",", " ") in page


FAULTS = ["silent", "careless", "forgetful", "poisoned"]


class Faulty(Instance):
    """An instance that does one thing wrong."""

    fault = ""

    def step(self, point: float, duration: float) -> int:
        """Takes what it must refuse."""
        if self.fault == "careless":
            super().step(point, duration)
            return 0
        return super().step(point, duration)

    def get(self, references: list[int], whole: bool = False) -> tuple[int, list[float]]:  # type: ignore[override]
        """Gives what is no number."""
        status, values = super().get(references, whole)
        bad = self.fault == "poisoned" and not whole
        return status, [float("nan")] * len(values) if bad else values

    def call(self, name: str, *arguments: object) -> int:
        """Restores nothing."""
        if self.fault == "forgetful" and name == "SetFMUstate":
            return 0
        return super().call(name, *arguments)

    def _hear(self, *words: object) -> None:
        if self.fault != "silent":
            super()._hear(*words)  # type: ignore[arg-type]


@pytest.mark.parametrize("fault", FAULTS)
def test_the_walk_sees_an_fmu_that_does_wrong(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Refusals without a sentence, bad steps taken, NaN, states that go on otherwise."""
    kind = type(fault, (Faulty,), {"fault": fault})
    monkeypatch.setattr("benchmarks.fmu_host.Instance", kind)
    with unpacked(template()) as place:
        library, wrong = Library(place), 0
        for seed in range(40):
            try:
                Walk(library, seed, Counter()).run(60)
            except WrongError:
                wrong += 1
    assert wrong > 0


CALLS: dict[str, Callable[[Instance], int]] = {
    "setup": lambda one: one.setup(0.0, None),
    "enter": lambda one: one.call("EnterInitializationMode"),
    "leave": lambda one: one.call("ExitInitializationMode"),
    "terminate": lambda one: one.call("Terminate"),
    "reset": lambda one: one.call("Reset"),
    "step": lambda one: one.step(0.0, 1e-3),
    "cancel": lambda one: one.call("CancelStep"),
    "get": lambda one: one.get([1, 2])[0],
    "set": lambda one: one.set([1, 2], [0.5, -0.5]),
    "slope": lambda one: one.slope([1, 2], [1, 1], [0.5, -0.5]),
    "output_slope": lambda one: one.output_slope([7, 8], 1)[0],
    "along": lambda one: one.along([7, 8], [1], [1.0])[0],
    "state": lambda one: one.forget(one.save()[1]),
    "logging": lambda one: one.call("SetDebugLogging", 0, 0, None),
}
WAYS = {
    MADE: [],
    OPEN: ["enter"],
    RUNNING: ["enter", "leave"],
    ENDED: ["enter", "leave", "terminate"],
    FAILED: ["enter", "leave", "blow"],
    LOST: ["enter", "leave", "blow", "terminate"],
}


@pytest.mark.parametrize("phase", WAYS)
def test_every_call_in_every_phase(phase: str) -> None:
    """Done where the standard allows it, else refused with one sentence that names the phase."""
    with unpacked(template()) as place:
        library = Library(place)
        for name, call in CALLS.items():
            one = library.instance(name)
            for way in WAYS[phase]:
                if way == "blow":
                    one.set([1, 2], [1e308, 1e308])
                    one.step(0.0, 1e-3)
                else:
                    CALLS[way](one)
            told = len(one.told)
            status = call(one)
            allowed = phase in ALLOWED[name] and (phase, name) != (LOST, "output_slope")
            assert status == (0 if allowed else 3), name
            if not allowed:
                (_, category, sentence) = one.told[-1]
                assert (len(one.told), category) == (told + 1, "logStatusError")
                assert sentence.startswith("fmi2")
            one.free()
