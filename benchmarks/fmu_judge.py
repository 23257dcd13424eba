"""What must hold of an FMU whatever is called, and the values that a random walk sets."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable
from ctypes import c_void_p
from dataclasses import dataclass, field

from benchmarks.fmu_host import Instance, Library
from corexy_fmi.fmu.variables import Variable

OK, DISCARD, ERROR = 0, 2, 3
MADE, OPEN, RUNNING, ENDED, FAILED = "made", "open", "running", "ended", "failed"
LOST = "lost"  # ended after it had failed
ANY = (MADE, OPEN, RUNNING, ENDED, FAILED, LOST)
# phases in which a call is allowed (FMI 2.0.5, 4.2.4); this FMU lets values be read in all of them
ALLOWED = {
    "setup": (MADE,),
    "enter": (MADE,),
    "leave": (OPEN,),
    "terminate": (RUNNING, FAILED),
    "reset": ANY,
    "step": (RUNNING,),
    "cancel": (),
    "get": ANY,
    "set": (MADE, OPEN, RUNNING),
    "slope": (MADE, OPEN, RUNNING),
    "output_slope": (OPEN, RUNNING, ENDED, LOST),
    "along": (OPEN, RUNNING, ENDED, LOST),
    "state": ANY,
    "status": ANY,
    "logging": ANY,
}
LIKELY = {
    "step": 12,
    "set": 6,
    "get": 5,
    "slope": 3,
    "leave": 3,
    "enter": 3,
    "setup": 2,
    "state": 3,
    "terminate": 0.3,
    "reset": 0.5,
}
BAD = (math.nan, math.inf, -math.inf)


class WrongError(AssertionError):
    """The FMU did what it must not."""


@dataclass
class Actor:
    """An instance with what must be true of it."""

    one: Instance
    phase: str = MADE
    now: float = 0.0
    stop: float = math.inf
    saved: list[tuple[c_void_p, str, float, float]] = field(default_factory=list)


@dataclass
class Judge:
    """Random numbers, counts and rules of one sequence."""

    library: Library
    seed: int
    counts: Counter[str]
    trail: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.random = random.Random(self.seed)
        self.inputs = [i for i, v in enumerate(self.library.variables) if v.role == "input"]
        self.outputs = [i for i, v in enumerate(self.library.variables) if v.role == "output"]
        real = [i for i, v in enumerate(self.library.variables) if v.kind == "Real"]
        self.parameters = [i for i in real if self.library.variables[i].role == "parameter"]
        self.whole = [i for i, v in enumerate(self.library.variables) if v.kind != "Real"]

    def must(self, holds: bool, words: str) -> None:
        """Raise where something does not hold."""
        if not holds:
            raise WrongError(words)

    def judge(self, actor: Actor, call: Callable[[], int], good: bool, maybe: bool = False) -> int:
        """Status of a call that must be done, or refused; ``maybe``: either, with a sentence."""
        before, told = self.outputs_of(actor), len(actor.one.told)
        status = call()
        sentences = actor.one.told[told:]
        if status not in ((OK, ERROR) if maybe else (OK,) if good else (ERROR,)):
            raise WrongError(f"status {status}: {sentences}")
        if status == ERROR:
            self.counts["refused"] += 1
            if not any(s == ERROR and len(text) > 20 for s, _, text in sentences):
                raise WrongError("refused without a sentence")
            seen = None if before is None else actor.one.get(self.outputs)
            if not (good or maybe) and repr(seen) != repr(before):
                raise WrongError("a refused call changed something")
        return status

    def outputs_of(self, actor: Actor) -> tuple[int, list[float]] | None:
        """What a running instance shows, now and then."""
        watched = actor.phase == RUNNING and self.random.random() < 0.3
        return actor.one.get(self.outputs) if watched else None

    def finite(self, values: list[float], actor: Actor) -> None:
        """After a call that went well and was not told to have failed."""
        if actor.phase not in (FAILED, LOST) and not all(map(math.isfinite, values)):
            raise WrongError(f"a value that is not finite: {values}")

    def value_of(self, v: Variable) -> tuple[float, bool]:
        """A value for a variable, and whether it may be set."""
        kind = self.random.random()
        if v.role in ("output", "time"):
            return 0.1, False
        if kind < 0.05:
            return self.random.choice(BAD), False
        if v.role == "input":
            scale = self.random.choice((1.0, 1.0, 10.0, 1e3, 1e9, 1e308 if kind < 0.2 else 1.0))
            return scale * self.random.uniform(-1.0, 1.0), True
        lower, upper = v.lower or 0.0, v.upper or 0.0
        if kind < 0.15:
            value = self.random.choice((lower - 1 - abs(lower), upper + 1 + abs(upper)))
            return value, value == v.neutral
        if kind < 0.3:
            return self.random.choice(
                (lower, upper, lower if v.neutral is None else v.neutral)
            ), True
        if (
            kind < 0.6
            and v.start is not None
            and (lower <= v.start <= upper or v.start == v.neutral)
        ):
            return v.start, True
        return self.random.uniform(lower, upper), True
