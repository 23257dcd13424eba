"""Parametrisation: what a fit moves, as one internal vector u for all runs.

u holds nominal parameters, effect parameters, then for each run its own nuisances: the rest it
begins with (belts deflected, idlers held by their friction; where any begins in motion how far off
an even one in place and speed), where any clock is free by how much its samples are late, and where
the memories of effects begin.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.balance import Pull, leaning, pulls
from corexy_fmi.engine.fitting.free_form import bending, law_places, law_unknowns, write_law
from corexy_fmi.engine.fitting.holding import push_scale, rest_scale
from corexy_fmi.engine.fitting.lanes import Lanes
from corexy_fmi.engine.fitting.scaling import eased, unseen
from corexy_fmi.engine.fitting.unknowns import (
    Hypothesis,
    Unknown,
    effect_unknowns,
    frees_rotor,
    nominal_unknowns,
)
from corexy_fmi.kernel.call import DEFLECTED, IDLERS, PUSH, REST, ROTORS, Array
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.machine import Machine
from corexy_fmi.simulate import machine_vector
from corexy_fmi.topology import STAGES

LATE, LATEST = 1e-3, 2.0  # [s] scale and bound of a free clock's offset


def _write_defaults(base: Array, instance: Instance) -> None:
    """What this drive does not fit stands at its default."""
    for k, p in enumerate(instance.effect.parameters):
        if p.default is not None:
            base[instance.parameter + k] = p.default


@dataclass(frozen=True, eq=False)
class Parametrisation:
    """A machine, its runs and a hypothesis, and what of them is free.

    ``pinned`` fixes nominal parameters.  ``base`` is the kernel's vector that the unknowns are
    written into, ``begins`` where in it it stands at what a memory begins, ``own_keys`` name the
    nuisances of each run, ``prior`` is mean and one over the deviation of u, (size,) each.
    """

    layout: Layout
    machine: Machine
    runs: tuple[Run, ...]
    hypothesis: Hypothesis = field(default_factory=Hypothesis)
    pinned: bool = False
    unknowns: tuple[Unknown, ...] = field(init=False)
    base: Array = field(init=False)
    begins: dict[str, int] = field(init=False)
    own_keys: tuple[str, ...] = field(init=False)
    prior: tuple[Array, Array] = field(init=False)

    def __post_init__(self) -> None:
        """Collect the unknowns and the vector that they are written into."""
        base = machine_vector(self.machine, self.layout)
        object.__setattr__(self, "unknowns", self._collected(base))
        object.__setattr__(self, "base", base)
        object.__setattr__(self, "begins", self._begins())
        clock = ("clock",) if any(run.clock_free for run in self.runs) else ()
        pushed = self._pushed() if any(run.moving for run in self.runs) else ()
        object.__setattr__(self, "own_keys", (*self.rest_keys, *pushed, *clock, *self.begins))
        own = [np.inf if key == "clock" else 1.0 for key in self.own_keys]
        std = np.array([u.prior_std for u in self.unknowns] + own * len(self.runs))
        object.__setattr__(
            self, "prior", (np.zeros(len(std)), np.where(np.isfinite(std), 1 / std, 0.0))
        )

    @cached_property
    def root(self) -> Array:
        """Square root (size, size) of the prior's precision: that of a law holds it straight."""
        found = np.diag(self.prior[1])
        for law in (law for law in self.hypothesis.laws if law.stiffness):
            at, bent = law_places(self.unknowns, law), bending(law)
            rows = np.vstack([np.diag(self.prior[1][at]), np.sqrt(law.stiffness) * bent])
            found[np.ix_(at, at)] = np.linalg.qr(rows)[1]
        return found

    def _collected(self, base: Array) -> tuple[Unknown, ...]:
        """All unknowns but the runs' own; what is not fitted is written into base."""
        free = frees_rotor([i.effect for i in self.hypothesis.uses])
        unknowns = [] if self.pinned else nominal_unknowns(self.machine, free)
        names = [run.name for run in self.runs]
        for instance in self.hypothesis.uses:
            shaped, extent = self.hypothesis.shaped, self._extent()
            unknowns += effect_unknowns(instance, self.machine.drive, names, shaped, extent)
            _write_defaults(base, instance)
        for law in self.hypothesis.laws:
            write_law(self.layout, base, law)
            unknowns += law_unknowns(self.layout, law, names, self._extent()["Hz"])
        held = dict(self.hypothesis.held)
        return tuple(x.near(held[x.key]) if x.key in held else x for x in unknowns)

    def _extent(self) -> dict[str, float]:
        """What the longest run covers: turns of a motor (infinite where unknown), seconds."""
        inputs = [(run.excitation.input1, run.excitation.input2) for run in self.runs]
        known = all(run.excitation.mode != "voltages" for run in self.runs)
        turns = max(np.ptp(i) for pair in inputs for i in pair) / (2 * np.pi) if known else np.inf
        seconds = max(np.ptp(run.excitation.time) for run in self.runs)
        return {"1": max(float(turns), 1e-9), "Hz": max(float(seconds), 1e-9)}

    @property
    def rest_keys(self) -> tuple[str, ...]:
        """What a run may begin with: idlers are held where there are any with dry friction, rotors
        off their command where a loop turns them.
        """
        stage = STAGES[self.machine.stage]
        constants = stage.constants(self.machine.parameters, float(self.machine.drive == "dc"))
        held = max(constants.coulomb[4:], default=0.0) > 0
        modes = {run.excitation.mode for run in self.runs}
        looped = "closed_loop" in modes and not any(stage.direct)
        return (*DEFLECTED, *(IDLERS if held else ()), *(ROTORS if looped else ()))

    def _pushed(self) -> tuple[str, ...]:
        """What may be off its course where a run begins in motion: imposed motors are not."""
        imposed = self.machine.drive != "dc" or any(STAGES[self.machine.stage].direct)
        return tuple(key for key in PUSH if not (imposed and "motor" in key))

    @cached_property
    def acting(self) -> tuple[Instance, ...]:
        """The effects of the machine and of the hypothesis."""
        given = {(use.name, use.location) for use in self.machine.effects}
        kept = [i for i in self.layout.instances if (i.effect.name, i.location) in given]
        return (*kept, *self.hypothesis.uses)

    @cached_property
    def pulls(self) -> tuple[Pull, ...]:
        """What pulls a stage that rests."""
        return pulls(self.acting)

    def _begins(self) -> dict[str, int]:
        """Where in the kernel's vector it stands at what a memory begins, by key."""
        return {
            f"{i.effect.name}.{i.location}.{i.effect.parameters[k].name}": i.parameter + k
            for i in self.acting
            for k in i.effect.initial_at(i.location)
        }

    @property
    def size(self) -> int:
        """Number of unknowns, each run's own included."""
        return len(self.unknowns) + self.own * len(self.runs)

    @property
    def own(self) -> int:
        """Number of nuisances of each run."""
        return len(self.own_keys)

    @property
    def keys(self) -> list[str]:
        """A key for each element of u."""
        own = [f"{key} of run {r}" for r in range(len(self.runs)) for key in self.own_keys]
        return [x.key for x in self.unknowns] + own

    def carried(self, other: Parametrisation, u: Array) -> Array:
        """Another problem's u (its size,) in this one's order; zero for what is new."""
        known = dict(zip(other.keys, u, strict=True))
        return np.array([known.get(key, 0.0) for key in self.keys])

    def first_own(self, run: int) -> int:
        """Index of a run's first nuisance."""
        return len(self.unknowns) + self.own * run

    @property
    def nominal_count(self) -> int:
        """Number of nominal unknowns; they come first."""
        return sum("." not in u.key for u in self.unknowns)

    def moving(self, run: int) -> np.ndarray:
        """Indices of the unknowns that move a run."""
        first = self.first_own(run)
        shared = [k for k, x in enumerate(self.unknowns) if x.run in (None, run)]
        return np.array([*shared, *range(first, first + self.own)])

    def vectors(self, u: Array, run: int) -> Array:
        """Kernel parameter vectors (sets, n) of internal vectors (sets, size) in a run."""
        result = np.repeat(self.base[None], len(u), axis=0)
        for k, unknown in enumerate(self.unknowns):
            if unknown.run in (None, run):
                result[:, unknown.index] = value = unknown.value(u[:, k])
                if unknown.mirror:
                    result[:, unknown.mirror[0]] = unknown.mirror[1] * value
        first = self.first_own(run + 1) - len(self.begins)
        for k, index in enumerate(self.begins.values(), first):
            result[:, index] = np.clip(self.base[index] + u[:, k], -1.0, 1.0)
        return result

    def rest(self, u: Array, run: int) -> Array:
        """What a run begins with, (sets, 6): `REST`."""
        found, r = np.zeros((len(u), len(REST))), self.runs[run]
        for k, key in enumerate(self.own_keys, self.first_own(run)):
            if key in REST:
                found[:, REST.index(key)] = u[:, k]
        scale = rest_scale(self.machine, r.excitation)
        if self.pulls and not r.excitation.lead:
            vectors = self.vectors(u, run)
            scale = scale + leaning(self.pulls, self.machine, r.excitation, vectors, self.base)
        return found * scale

    def push(self, u: Array, run: int) -> Array | None:
        """How far a run that begins in motion is off its even course, (sets, 8): `PUSH`."""
        r = self.runs[run]
        if not r.moving:
            return None
        found = np.zeros((len(u), len(PUSH)))
        for k, key in enumerate(self.own_keys, self.first_own(run)):
            if key in PUSH:
                found[:, PUSH.index(key)] = u[:, k]
        return found * push_scale(self.machine, r.pace)

    def lanes(self, u: Array, run: int) -> Lanes:
        """The sets of u (sets, size) in a run, as the kernel runs them."""
        delay = None
        if self.runs[run].clock_free:
            delay = LATE * u[:, self.first_own(run) + self.own_keys.index("clock")]
        return Lanes(self.vectors(u, run), self.rest(u, run), self.push(u, run), delay)

    def limits(self) -> tuple[Array, Array]:
        """Lower and upper bounds of u, (size,) each."""
        pairs = [x.limits() for x in self.unknowns]
        for run in self.runs:
            reach = LATEST / LATE if run.clock_free else 0.0
            bounds = {"clock": reach} | dict.fromkeys((*DEFLECTED, *ROTORS, *PUSH), 6.0)
            pairs += [(-bounds.get(key, 1.0), bounds.get(key, 1.0)) for key in self.own_keys]
        low, high = np.array(pairs).T
        return low, high

    def scale_unseen(self, u: Array, jacobian: Array) -> bool:
        """Whether a Jacobian (samples + size, size) at u tells no common factor of all forces."""
        return unseen(self.unknowns, u, jacobian[: -self.size], self.prior[1])

    def eased(self, sets: Array) -> Array:
        """Sets (sets, size), each with the common factor of all forces that its priors like."""
        return np.array([eased(self.unknowns, u, self.prior[1]) for u in sets])
