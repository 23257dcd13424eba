"""A random walk of instances through every function of FMI 2.0, in any order."""

from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import byref, c_int, c_void_p

from benchmarks.fmu_judge import (
    ALLOWED,
    BAD,
    DISCARD,
    ENDED,
    FAILED,
    LIKELY,
    LOST,
    MADE,
    OK,
    OPEN,
    RUNNING,
    Actor,
    Judge,
    WrongError,
)


class Walk(Judge):
    """One sequence; ``soundness`` is the share of calls that come in their right order."""

    soundness = 0.75

    def run(self, calls: int) -> None:
        """Walk; raises WrongError with the trail."""
        count = self.random.choice((1, 1, 2))
        actors = [Actor(self.library.instance(f"walk{n}")) for n in range(count)]
        try:
            self.short_cut(actors[0])
            for _ in range(self.random.randrange(3, calls)):
                self.act(self.random.choice(actors))
        except WrongError as error:
            raise WrongError(f"seed {self.seed}: {error}; {' '.join(self.trail[-12:])}") from error
        finally:
            for actor in actors:
                self.end(actor)

    def short_cut(self, actor: Actor) -> None:
        """Most walks begin as masters do."""
        for name in ("set", "setup", "enter", "set", "leave")[: self.random.choice((0, 3, 5, 5))]:
            self.act(actor, name)

    def act(self, actor: Actor, name: str | None = None) -> None:
        """One call."""
        sound = self.random.random() < self.soundness
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
        pool = (
            set(self.whole) if whole else set(range(len(self.library.variables))) - set(self.whole)
        )
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

    def restore(
        self,
        actor: Actor,
        state: c_void_p,
        phase: str,
        now: float,
        stop: float,
        through_bytes: bool,
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
        _, content = actor.one.serialised(state)
        wrong = bytearray(content)
        wrong[self.random.randrange(len(wrong))] ^= 1 << self.random.randrange(8)
        self.judge(actor, lambda: actor.one.restored(bytes(wrong))[0], False)

    def again(self, actor: Actor) -> None:
        """A step done twice from one state gives the same bits."""
        _, state = actor.one.save()
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
        found = actor.one.call("GetStatus", 0, byref(c_int()))
        self.must(found == DISCARD and len(actor.one.told) == told + 1, f"status {found}")

    def logging(self, actor: Actor, allowed: bool) -> None:
        """On, off, unknown to it."""
        self.must(
            actor.one.call("SetDebugLogging", self.random.choice((0, 1)), 0, None) == OK, "log"
        )
