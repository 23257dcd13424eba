"""The standard's state machine against the FMU, by hypothesis: what fails is shrunk to few calls.

Calls, values and judgement are those of the random walks (`benchmarks/fmu_walk.py`); ten thousand
of them are in `benchmarks/fmu_fuzz.py`.
"""

from __future__ import annotations

import faulthandler
import sys
from collections import Counter
from collections.abc import Iterator
from random import Random
from typing import ClassVar

import pytest
from fmu_kit import FLAVOURS, template
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)
from test_fmu_fuzz import Faulty

from benchmarks.fmu_fuzz import WALKS
from benchmarks.fmu_host import Library
from benchmarks.fmu_judge import ALLOWED, LIKELY, RUNNING, Actor, WrongError
from benchmarks.fmu_walk import Walk
from corexy_fmi.fmu.session import unpacked

BEGIN = ("setup", "enter", "set", "leave")
CALLS = st.sampled_from((0, 2, len(BEGIN), len(BEGIN)))
LIKELIEST = sorted(ALLOWED, key=lambda name: -LIKELY.get(name, 1))
OFTEN = [name for name in LIKELIEST for _ in range(round(LIKELY.get(name, 1)) or 1)]
WHICH, VALUES = st.integers(0, 1), st.integers(0, 2**32 - 1)  # instance, seed of a call's values
SEARCH = settings(
    max_examples=30,
    stateful_step_count=40,
    derandomize=True,
    database=None,
    deadline=None,
    report_multiple_bugs=False,
    suppress_health_check=list(HealthCheck),
    phases=(Phase.generate, Phase.shrink),
)
LONGEST = 100.0  # [s] of a test, then the process ends with a trace: a call hangs


class Standard(RuleBasedStateMachine):
    """Two instances; every function where FMI 2.0.5 (4.2.4) allows it, and where it does not.

    Subclasses set ``library`` and ``kind``.
    """

    library: ClassVar[Library]
    kind: ClassVar[type[Walk]] = Walk
    counts: ClassVar[Counter[str]] = Counter()
    trail: ClassVar[list[str]] = []

    def __init__(self) -> None:
        super().__init__()
        self.walk = self.kind(self.library, 0, self.counts)
        self.actors = [Actor(self.library.instance(f"states{n}")) for n in range(2)]
        type(self).trail = self.walk.trail

    @initialize(calls=st.tuples(CALLS, CALLS), values=VALUES)
    def begin(self, calls: tuple[int, int], values: int) -> None:
        """As masters do, or less."""
        for actor, count in zip(self.actors, calls, strict=True):
            for name in BEGIN[:count]:
                self.act(actor, name, values)

    def act(self, actor: Actor, name: str, values: int) -> None:
        """One call with the walk's good and bad values."""
        self.walk.random = Random(values)
        self.walk.act(actor, name)

    @rule(data=st.data(), which=WHICH, values=VALUES)
    def call(self, data: st.DataObject, which: int, values: int) -> None:
        """What the standard allows in this phase, as often as in the walks, or what it forbids."""
        actor = self.actors[which]
        allowed = [name for name in OFTEN if actor.phase in ALLOWED[name]]
        forbidden = [name for name in ALLOWED if actor.phase not in ALLOWED[name]]
        self.act(actor, data.draw(st.sampled_from(allowed + forbidden), label="call"), values)

    @invariant()
    def outputs_are_finite(self) -> None:
        """As long as a run goes on."""
        for actor in self.actors:
            if actor.phase == RUNNING:
                self.walk.finite(actor.one.get(self.walk.outputs)[1], actor)

    def teardown(self) -> None:
        """Both instances and their states."""
        for actor in self.actors:
            self.walk.end(actor)


def machine(library: Library, flavour: str = "native") -> type[Standard]:
    """The state machine of a library."""
    kept = {"library": library, "kind": WALKS[flavour], "counts": Counter()}
    return type("Machine", (Standard,), kept)


@pytest.fixture(autouse=True)
def limit() -> Iterator[None]:
    """A call that hangs ends the process."""
    faulthandler.dump_traceback_later(LONGEST, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_no_sequence_breaks_the_standard(flavour: str) -> None:
    """Done where allowed, else refused with a sentence; the pythonfmu flavour survives."""
    with unpacked(template(flavour)) as place:
        tried = machine(Library(place), flavour)
        run_state_machine_as_test(tried, settings=SEARCH)
    assert tried.counts["steps"] > {"native": 60, "python": 0}[flavour]
    assert tried.counts["refused"] > 100


@pytest.mark.parametrize("fault", ["careless", "poisoned"])
def test_a_fault_is_found_and_shrunk(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the few calls that show it."""
    kind = type(fault, (Faulty,), {"fault": fault})
    monkeypatch.setattr("benchmarks.fmu_host.Instance", kind)
    with unpacked(template()) as place:
        tried = machine(Library(place))
        with pytest.raises(WrongError):
            run_state_machine_as_test(tried, settings=SEARCH)
    assert len(tried.trail) <= 5
