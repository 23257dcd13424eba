"""Random sequences of calls with good and bad values against the standard's state machine.

    python -m benchmarks.fmu_fuzz [--sequences 10000] [--seed 0]

walks instances of the native FMU through every function in any order.  What the standard allows must
be done, what it does not must be refused with a sentence and change nothing, no value that was given
as good may be infinite or NaN, and a saved state must go on bit for bit.  A crash or a sequence
longer than a minute ends the process.  Writes benchmarks/results/fmu_fuzz.json.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import math
import random
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from ctypes import c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.fmu_host import Instance, Library
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.session import unpacked
from corexy_fmi.fmu.variables import Variable

RESULT = Path(__file__).parent / "results" / "fmu_fuzz.json"
OK, DISCARD, ERROR = 0, 2, 3
MADE, OPEN, RUNNING, ENDED, FAILED = "made", "open", "running", "ended", "failed"
LOST = "lost"  # ended after it had failed
ANY = (MADE, OPEN, RUNNING, ENDED, FAILED, LOST)
# phases in which a call is allowed (FMI 2.0.5, 4.2.4; this FMU also lets values be read at any time)
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
LIKELY = {"step": 12, "set": 6, "get": 5, "slope": 3, "leave": 3, "enter": 3, "setup": 2, "state": 3, "terminate": 0.3, "reset": 0.5}
BAD = (math.nan, math.inf, -math.inf)
LONGEST = 60.0  # [s] of a sequence


class Wrong(AssertionError):
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
class Walk:
    """One sequence: its random numbers, its actors, its counts."""

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

    def run(self, calls: int) -> None:
        """Walk; raises Wrong with the trail."""
        count = self.random.choice((1, 1, 2))
        actors = [Actor(self.library.instance(f"walk{n}")) for n in range(count)]
        try:
            self.short_cut(actors[0])
            for _ in range(self.random.randrange(3, calls)):
                self.act(self.random.choice(actors))
        except Wrong as error:
            raise Wrong(f"seed {self.seed}: {error}; {' '.join(self.trail[-12:])}") from error
        finally:
            for actor in actors:
                self.end(actor)

    def short_cut(self, actor: Actor) -> None:
        """Most walks begin as masters do."""
        for name in ("set", "setup", "enter", "set", "leave")[: self.random.choice((0, 3, 5, 5))]:
            self.act(actor, name)

    def act(self, actor: Actor, name: str | None = None) -> None:
        """One call."""
        sound = self.random.random() < 0.75
        names = [n for n in ALLOWED if not sound or actor.phase in ALLOWED[n]]
        chosen = name or self.random.choices(names, [LIKELY.get(n, 1) for n in names])[0]
        self.trail.append(f"{chosen}@{actor.phase}")
        self.counts["calls"] += 1
        method: Callable[[Actor, bool], None] = getattr(self, chosen)
        method(actor, actor.phase in ALLOWED[chosen])

    def end(self, actor: Actor) -> None:
        """Saved states and the instance itself, whatever it was doing."""
        for state, *_ in actor.saved:
            actor.one.forget(state)
        actor.one.free()

    # what must hold

    def judge(self, actor: Actor, call: Callable[[], int], good: bool, maybe: bool = False) -> int:
        """Status of a call that must be done, or refused; ``maybe``: either, with a sentence."""
        before, told = self.outputs_of(actor), len(actor.one.told)
        status = call()
        sentences = actor.one.told[told:]
        if status not in ((OK, ERROR) if maybe else (OK,) if good else (ERROR,)):
            raise Wrong(f"status {status}: {sentences}")
        if status == ERROR:
            self.counts["refused"] += 1
            if not any(s == ERROR and len(text) > 20 for s, _, text in sentences):
                raise Wrong("refused without a sentence")
            seen = None if before is None else actor.one.get(self.outputs)
            if not (good or maybe) and repr(seen) != repr(before):
                raise Wrong("a refused call changed something")
        return status

    def outputs_of(self, actor: Actor) -> tuple[int, list[float]] | None:
        """What a running instance shows, now and then."""
        watched = actor.phase == RUNNING and self.random.random() < 0.3
        return actor.one.get(self.outputs) if watched else None

    def finite(self, values: list[float], actor: Actor) -> None:
        """After a call that went well and was not told to have failed."""
        if actor.phase not in (FAILED, LOST) and not all(map(math.isfinite, values)):
            raise Wrong(f"a value that is not finite: {values}")

    # values

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
            return self.random.choice((lower, upper, lower if v.neutral is None else v.neutral)), True
        if kind < 0.6 and v.start is not None and (lower <= v.start <= upper or v.start == v.neutral):
            return v.start, True
        return self.random.uniform(lower, upper), True

    # calls, by the names of ALLOWED

    def setup(self, actor: Actor, allowed: bool) -> None:
        """Start and stop time."""
        start = self.random.choice((0.0, 0.0, 2.5, -1.0, *BAD))
        stop = self.random.choice((None, None, start + 0.05, start - 1.0, math.nan))
        good = math.isfinite(start) and (stop is None or stop >= start)
        status = self.judge(actor, lambda: actor.one.setup(start, stop), allowed and good)
        if status == OK:
            actor.now, actor.stop = start, math.inf if stop is None else stop

    def enter(self, actor: Actor, allowed: bool) -> None:
        """Into the initialisation."""
        if self.judge(actor, lambda: actor.one.call("EnterInitializationMode"), allowed) == OK:
            actor.phase = OPEN

    def leave(self, actor: Actor, allowed: bool) -> None:
        """Out of it; what was set may contradict itself."""
        call = actor.one.call
        if self.judge(actor, lambda: call("ExitInitializationMode"), False, allowed) == OK:
            actor.phase = RUNNING

    def terminate(self, actor: Actor, allowed: bool) -> None:
        """Early or late."""
        if self.judge(actor, lambda: actor.one.call("Terminate"), allowed) == OK:
            actor.phase = LOST if actor.phase == FAILED else ENDED

    def reset(self, actor: Actor, allowed: bool) -> None:
        """From anywhere; the start time is that of a new instance again."""
        self.judge(actor, lambda: actor.one.call("Reset"), allowed)
        actor.phase, actor.now, actor.stop = MADE, 0.0, math.inf

    def step(self, actor: Actor, allowed: bool) -> None:
        """Good and bad times; a state that blows up fails, and is told."""
        duration = self.random.choice((1e-3, 1e-3, 10 ** self.random.uniform(-6, -1.3)))
        point, kind = actor.now, self.random.random()
        if kind < 0.1:
            duration = self.random.choice((0.0, -1e-3, 1e300, *BAD))
        elif kind < 0.2:
            point = self.random.choice((actor.now + 1.0, actor.now - 1.0, *BAD))
        within = actor.now + duration <= actor.stop + 1e-9
        good = allowed and kind >= 0.2 and within
        status = self.judge(actor, lambda: actor.one.step(point, duration), good, good)
        self.counts["steps"] += status == OK
        if good:
            actor.phase = RUNNING if status == OK else FAILED
            actor.now = actor.now + duration if status == OK else actor.now

    def cancel(self, actor: Actor, allowed: bool) -> None:
        """Never."""
        self.judge(actor, lambda: actor.one.call("CancelStep"), allowed)

    def get(self, actor: Actor, allowed: bool) -> None:
        """Any variable; outputs of what contradicts itself are refused."""
        chosen = self.random.sample(range(len(self.library.variables)), 3)
        if self.random.random() < 0.1:
            chosen[0] = self.random.choice((len(self.library.variables), 2**31, 2**32 - 1))
        whole = self.random.random() < 0.2
        pool = set(self.whole) if whole else set(range(len(self.library.variables))) - set(self.whole)
        good = set(chosen) <= pool
        maybe = good and actor.phase in (MADE, OPEN) and not set(chosen).isdisjoint(self.outputs)
        found: list[float] = []

        def call() -> int:
            status, values = actor.one.get(chosen, whole)
            found.extend(values)
            return status

        if self.judge(actor, call, good, maybe) == OK:
            self.finite(found, actor)

    def set(self, actor: Actor, allowed: bool) -> None:
        """Inputs, or parameters while they are open."""
        whole = self.random.random() < 0.15
        fixed = whole or self.random.random() < 0.4
        pool = self.whole if whole else self.parameters if fixed else self.inputs
        chosen = self.random.sample(pool, self.random.randrange(1, 4))
        if self.random.random() < 0.05:
            chosen[-1] = self.random.choice(self.outputs)
        pairs = [self.value_of(self.library.variables[i]) for i in chosen]
        values = [round(v) if whole and math.isfinite(v) else v for v, _ in pairs]
        if whole and not all(map(math.isfinite, values)):
            return
        good = allowed and all(g for _, g in pairs) and not (fixed and actor.phase == RUNNING)
        good = good and (not whole or set(chosen) <= set(self.whole))
        self.judge(actor, lambda: actor.one.set(chosen, values, whole), good)

    def slope(self, actor: Actor, allowed: bool) -> None:
        """Input derivatives."""
        order, target = self.random.choice((1, 1, 1, 2, 0)), self.random.choice(self.inputs)
        if self.random.random() < 0.1:
            target = self.random.choice(self.outputs)
        value = self.random.choice((0.0, 3.0, -50.0, 1e300, math.nan))
        good = allowed and order == 1 and target in self.inputs and math.isfinite(value)
        self.judge(actor, lambda: actor.one.slope([target], [order], [value]), good)

    def output_slope(self, actor: Actor, allowed: bool) -> None:
        """Derivatives of outputs; a state near its end may not bear a look ahead."""
        order, found = self.random.choice((1, 1, 2)), list[float]()
        targets = self.random.sample(self.outputs, 2)

        def call() -> int:
            status, values = actor.one.output_slope(targets, order)
            found.extend(values)
            return status

        good = allowed and order == 1
        if self.judge(actor, call, good, good) == OK:
            self.finite(found, actor)

    def along(self, actor: Actor, allowed: bool) -> None:
        """Directional derivatives; some values have none."""
        knowns = [self.random.choice(self.inputs), self.random.choice(self.parameters)]
        seeds = [self.random.choice((1.0, 0.0, math.nan)), 1.0]
        found: list[float] = []

        def call() -> int:
            status, values = actor.one.along(self.outputs[:4], knowns, seeds)
            found.extend(values)
            return status

        maybe = actor.phase == OPEN and math.isfinite(seeds[0])
        if self.judge(actor, call, False, maybe) == OK:
            self.finite(found, actor)

    def state(self, actor: Actor, allowed: bool) -> None:
        """Saved, restored, through bytes, damaged."""
        kind = self.random.choice(("save", "save", "restore", "bytes", "damage", "again"))
        if kind == "save" and len(actor.saved) < 3:
            status, state = actor.one.save()
            self.must(status == OK and bool(state), "no state")
            actor.saved.append((state, actor.phase, actor.now, actor.stop))
        elif actor.saved and kind in ("restore", "bytes"):
            self.restore(actor, *self.random.choice(actor.saved), through_bytes=kind == "bytes")
        elif actor.saved and kind == "damage":
            self.damage(actor, actor.saved[0][0])
        elif kind == "again" and actor.phase == RUNNING:
            self.again(actor)

    def must(self, holds: bool, words: str) -> None:
        """Raise where something does not hold."""
        if not holds:
            raise Wrong(words)

    def restore(
        self, actor: Actor, state: c_void_p, phase: str, now: float, stop: float, through_bytes: bool
    ) -> None:
        """As it was then."""
        if through_bytes:
            status, content = actor.one.serialised(state)
            self.must(status == OK, "no bytes")
            status, state = actor.one.restored(content)
            self.must(status == OK, "bytes were refused")
        self.must(actor.one.call("SetFMUstate", state) == OK, "a state was refused")
        if through_bytes:
            actor.one.forget(state)
        actor.phase, actor.now, actor.stop = phase, now, stop

    def damage(self, actor: Actor, state: c_void_p) -> None:
        """One bit turned."""
        status, content = actor.one.serialised(state)
        wrong = bytearray(content)
        wrong[self.random.randrange(len(wrong))] ^= 1 << self.random.randrange(8)
        self.judge(actor, lambda: actor.one.restored(bytes(wrong))[0], False)

    def again(self, actor: Actor) -> None:
        """A step done twice from one state gives the same bits."""
        status, state = actor.one.save()
        rows = []
        for _ in range(2):
            outcome = actor.one.step(actor.now, 1e-3)
            rows.append(repr((outcome, actor.one.get(self.outputs))))
            self.must(actor.one.call("SetFMUstate", state) == OK, "a state was refused")
        actor.one.forget(state)
        self.must(rows[0] == rows[1], "a restored state goes on otherwise")
        self.counts["repeated"] += 1

    def status(self, actor: Actor, allowed: bool) -> None:
        """Nothing is ever pending."""
        told = len(actor.one.told)
        found = actor.one.call("GetStatus", 0, None)
        self.must(found == DISCARD and len(actor.one.told) == told + 1, f"status {found}")

    def logging(self, actor: Actor, allowed: bool) -> None:
        """On, off, unknown to it."""
        self.must(actor.one.call("SetDebugLogging", self.random.choice((0, 1)), 0, None) == OK, "log")


def walk(library: Library, sequences: int, seed: int, calls: int = 60) -> dict[str, Any]:
    """Counts of some sequences, and what was wrong."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    slowest = 0.0
    for n in range(seed, seed + sequences):
        faulthandler.dump_traceback_later(LONGEST, exit=True)
        begun = time.perf_counter()
        try:
            Walk(library, n, counts).run(calls)
        except Wrong as error:
            wrong.append(str(error))
        slowest = max(slowest, time.perf_counter() - begun)
    faulthandler.cancel_dump_traceback_later()
    return {"sequences": sequences, "seed": seed, **counts, "slowest_s": slowest, "wrong": wrong}


def main() -> None:
    """Walk, print and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sequences", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--print", action="store_true", help="write no file")
    words = parser.parse_args()
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, unpacked(build_fmu(Path(folder))) as place:
        result = walk(Library(place), words.sequences, words.seed)
    seconds = time.perf_counter() - begun
    commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    command = f"python -m benchmarks.fmu_fuzz --sequences {words.sequences} --seed {words.seed}"
    document = {"command": command, "commit": commit.strip(), "seconds": seconds, **result}
    text = json.dumps(document, indent=1)
    print(text)
    if not words.print:
        RESULT.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
