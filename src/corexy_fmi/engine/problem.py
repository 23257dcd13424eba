"""The output-error problem: whitened residuals of a hypothesis over runs, and their Jacobian.

Vector u: nominal parameters, effect parameters, then for each run its own nuisances: the rest it
begins with (belts deflected, idlers held by their friction; where any begins in motion how far off
an even one in place and speed), where any clock is free by how much
its samples are late, and where the memories of effects begin.  Offsets of the channels are
projected out, so that they cost no unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np

from corexy_fmi.engine.free_form import law_unknowns, write_law
from corexy_fmi.engine.holding import deflection_scale, push_scale
from corexy_fmi.engine.lanes import Lanes
from corexy_fmi.engine.micro_step import SHORTEST, damped, damps, needed, own_step
from corexy_fmi.engine.noise import Noise
from corexy_fmi.engine.samples import Run
from corexy_fmi.engine.scaling import eased, unseen
from corexy_fmi.engine.slopes import linearised
from corexy_fmi.engine.unknowns import (
    Hypothesis,
    Unknown,
    effect_unknowns,
    frees_rotor,
    nominal_unknowns,
)
from corexy_fmi.engine.whitening import Filter
from corexy_fmi.kernel.call import PUSH, REST, Array, Excitation, run_lanes
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.kernel.spare import shared
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
class Problem:
    """A machine, runs with their noise, and a hypothesis.

    ``noise`` holds one `Noise` for each channel of each run; ``pinned`` fixes nominal parameters.
    ``limit`` is the micro-step [s], one for all sets of a fit: the machine file's, or what the
    effects need where they begin; 0, each machine's own, where pinned.  ``coarse`` lengthens
    both.  Where the hypothesis damps belts, it is halved as the damping at hand asks.
    """

    layout: Layout
    machine: Machine
    runs: tuple[Run, ...]
    noise: tuple[tuple[Noise, ...], ...]
    hypothesis: Hypothesis = field(default_factory=Hypothesis)
    pinned: bool = False
    coarse: float = 1.0
    unknowns: tuple[Unknown, ...] = field(init=False)
    base: Array = field(init=False)
    begins: dict[str, int] = field(init=False)
    own_keys: tuple[str, ...] = field(init=False)
    prior: tuple[Array, Array] = field(init=False)
    limit: float = field(init=False)

    def __post_init__(self) -> None:
        """Collect the unknowns and the vector that they are written into."""
        free = frees_rotor([i.effect for i in self.hypothesis.uses])
        unknowns = [] if self.pinned else nominal_unknowns(self.machine, free)
        base = machine_vector(self.machine, self.layout)
        names = [run.name for run in self.runs]
        for instance in self.hypothesis.uses:
            shaped, extent = self.hypothesis.shaped, self._extent()
            unknowns += effect_unknowns(instance, self.machine.drive, names, shaped, extent)
            _write_defaults(base, instance)
        if self.hypothesis.law:
            write_law(self.layout, base, self.hypothesis.law)
            unknowns += law_unknowns(self.layout, self.hypothesis.law)
        held = dict(self.hypothesis.held)
        near = (x.near(held[x.key]) if x.key in held else x for x in unknowns)
        object.__setattr__(self, "unknowns", tuple(near))
        object.__setattr__(self, "base", base)
        limit = 0.0 if self.pinned else self._limit(base)
        object.__setattr__(self, "limit", limit)
        begins = self._begins()
        clock = ("clock",) if any(run.clock_free for run in self.runs) else ()
        pushed = self._pushed() if any(run.moving for run in self.runs) else ()
        object.__setattr__(self, "begins", begins)
        object.__setattr__(self, "own_keys", (*self._rest(), *pushed, *clock, *begins))
        own = [np.inf if key == "clock" else 1.0 for key in self.own_keys]
        std = np.array([u.prior_std for u in unknowns] + own * len(self.runs))
        object.__setattr__(
            self, "prior", (np.zeros(len(std)), np.where(np.isfinite(std), 1 / std, 0.0))
        )

    def _limit(self, base: Array) -> float:
        own = own_step(self.layout, base.tobytes(), self.machine.stage, self.machine.drive)
        least = needed(self.layout, self.machine, base, self.hypothesis, self.coarse)
        return max(min(self.coarse * own, least), own / SHORTEST)

    @property
    def size(self) -> int:
        """Number of unknowns, each run's own included."""
        return len(self.unknowns) + self.own * len(self.runs)

    def _extent(self) -> dict[str, float]:
        """What the longest run covers: turns of a motor (infinite where unknown), seconds."""
        inputs = [(run.excitation.input1, run.excitation.input2) for run in self.runs]
        known = all(run.excitation.mode != "voltages" for run in self.runs)
        turns = max(np.ptp(i) for pair in inputs for i in pair) / (2 * np.pi) if known else np.inf
        seconds = max(np.ptp(run.excitation.time) for run in self.runs)
        return {"1": max(float(turns), 1e-9), "Hz": max(float(seconds), 1e-9)}

    def _rest(self) -> tuple[str, ...]:
        """What a run may begin with: idlers are held where there are any with dry friction."""
        stage = STAGES[self.machine.stage]
        constants = stage.constants(self.machine.parameters, float(self.machine.drive == "dc"))
        return REST if max(constants.coulomb[4:], default=0.0) > 0 else REST[:2]

    def _pushed(self) -> tuple[str, ...]:
        """What may be off its course where a run begins in motion: imposed motors are not."""
        imposed = self.machine.drive != "dc" or any(STAGES[self.machine.stage].direct)
        return tuple(key for key in PUSH if not (imposed and "motor" in key))

    def _begins(self) -> dict[str, int]:
        """Where in the kernel's vector it stands at what a memory begins, by key."""
        given = {(use.name, use.location) for use in self.machine.effects}
        kept = [i for i in self.layout.instances if (i.effect.name, i.location) in given]
        return {
            f"{i.effect.name}.{i.location}.{i.effect.parameters[k].name}": i.parameter + k
            for i in (*kept, *self.hypothesis.uses)
            for k in i.effect.initial_at(i.location)
        }

    @property
    def own(self) -> int:
        """Number of nuisances of each run."""
        return len(self.own_keys)

    @property
    def keys(self) -> list[str]:
        """A key for each element of u."""
        own = [f"{key} of run {r}" for r in range(len(self.runs)) for key in self.own_keys]
        return [x.key for x in self.unknowns] + own

    def carried(self, other: Problem, u: Array) -> Array:
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
        """What a run begins with, (sets, 4): `REST`."""
        first, count = self.first_own(run), sum(key in REST for key in self.own_keys)
        found = np.zeros((len(u), len(REST)))
        found[:, :count] = u[:, first : first + count]
        found[:, :2] *= deflection_scale(self.machine)
        return found

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

    @cached_property
    def damping(self) -> list[int]:
        """Where in the kernel's vector it stands how much the hypothesis damps belts."""
        return [
            i.parameter + k
            for i in self.hypothesis.uses
            if damps(i)
            for k, p in enumerate(i.effect.parameters)
            if p.size
        ]

    def lanes(self, u: Array, run: int) -> Lanes:
        """The sets of u (sets, size) in a run, as the kernel runs them."""
        delay = None
        if self.runs[run].clock_free:
            delay = LATE * u[:, self.first_own(run) + self.own_keys.index("clock")]
        return Lanes(self.vectors(u, run), self.rest(u, run), self.push(u, run), delay)

    def simulate(
        self,
        u: Array,
        run: int,
        outputs: tuple[str, ...] | None = None,
        imposed: Excitation | None = None,
        inputs: Array | None = None,
    ) -> Array:
        """Outputs (sets, channels, rows) of a run, its motors on ``imposed`` angles where given;
        ``inputs`` (2, sets, rows) of each set stand for the run's where given.
        """
        return self._ran(self.lanes(u, run), run, outputs, imposed, inputs)

    def _ran(
        self,
        lanes: Lanes,
        run: int,
        outputs: tuple[str, ...] | None = None,
        imposed: Excitation | None = None,
        inputs: Array | None = None,
    ) -> Array:
        r, limit = self.runs[run], self.limit
        if self.damping and limit > 0:
            limit = damped(self.layout, self.machine, lanes.vectors, self.damping, limit)
        return run_lanes(
            self.layout,
            imposed or r.excitation,
            lanes.vectors,
            inputs=inputs,
            fidelity=self.machine.stage,
            dc=self.machine.drive == "dc" and imposed is None,
            rest=lanes.rest,
            push=None if imposed else lanes.push,
            channels=outputs or r.outputs,
            limit=limit,
        )

    def shown(self, lanes: Lanes, run: int, inputs: Array | None = None) -> Array:
        """What the sensors of a run would show, (sets, channels, rows); ``inputs``: `simulate`."""
        out = self._ran(lanes, run, inputs=inputs)
        time = self.runs[run].excitation.time
        return out if lanes.delay is None else late(time, out, lanes.delay)

    def errors(self, u: Array, run: int, inputs: Array | None = None) -> list[Array]:
        """Measured minus simulated for each channel, (sets, samples) each, offsets left in;
        ``inputs``: `simulate`.
        """
        out = self.shown(self.lanes(u, run), run, inputs)
        return [s.value - out[:, c, s.rows] for c, s in enumerate(self.runs[run].samples)]

    @cached_property
    def filters(self) -> list[list[Filter]]:
        """What whitens each channel of each run."""
        return [
            [
                Filter(noise, samples, samples.channel not in run.zeroed)
                for samples, noise in zip(run.samples, models, strict=True)
            ]
            for run, models in zip(self.runs, self.noise, strict=True)
        ]

    def whiten(self, errors: list[Array], run: int) -> Array:
        """Whitened errors (sets, samples) of a run, their channels side by side."""
        filters = zip(errors, self.filters[run], strict=True)
        return np.concatenate([f.white(e) for e, f in filters], axis=1)

    def _parted(self, white: Sequence[Array], run: int) -> list[tuple[Filter, list[Array]]]:
        """Each channel's filter, and its parts of arrays (samples,) of a run."""
        found, at = [], 0
        for f in self.filters[run]:
            found.append((f, [w[at : at + f.count] for w in white]))
            at += f.count
        return found

    def whitened(self, lanes: Lanes, run: int, white: Sequence[Array]) -> None:
        """Whitened residuals of the sets of a run into arrays (samples,), one for each."""
        out = self.shown(lanes, run)
        for c, (f, parts) in enumerate(self._parted(white, run)):
            f.rows(out[:, c], parts)

    def residual(self, u: Array) -> Array:
        """Whitened residuals with the priors behind them, (sets, samples + size)."""
        parts, samples = self.parts, self.parts[-1].stop
        result = np.empty((len(u), samples + self.size))
        shared(
            lambda r: self.whitened(self.lanes(u, r), r, list(result[:, parts[r]])),
            range(len(parts)),
        )
        result[:, samples:] = (u - self.prior[0]) * self.prior[1]
        return result

    @cached_property
    def parts(self) -> list[slice]:
        """Where the samples of each run stand in a residual."""
        return [
            slice(*ends) for ends in pairwise(accumulate((r.count for r in self.runs), initial=0))
        ]

    def moving(self, run: int) -> np.ndarray:
        """Indices of the unknowns that move a run."""
        first = self.first_own(run)
        shared = [k for k, x in enumerate(self.unknowns) if x.run in (None, run)]
        return np.array([*shared, *range(first, first + self.own)])

    def linearised(
        self, u: Array, borrowed: Array | None = None, stretch: float = 1.0
    ) -> tuple[Array, Array]:
        """Residual (samples + size,) at u (size,) and its derivative (`slopes.py`)."""
        return linearised(self, u, borrowed, stretch)

    def scale_unseen(self, u: Array, jacobian: Array) -> bool:
        """Whether a Jacobian (samples + size, size) at u tells no common factor of all forces."""
        return unseen(self.unknowns, u, jacobian[: -self.size], self.prior[1])

    def eased(self, sets: Array) -> Array:
        """Sets (sets, size), each with the common factor of all forces that its priors like."""
        return np.array([eased(self.unknowns, u, self.prior[1]) for u in sets])

    def limits(self) -> tuple[Array, Array]:
        """Lower and upper bounds of u, (size,) each."""
        pairs = [x.limits() for x in self.unknowns]
        for run in self.runs:
            reach = LATEST / LATE if run.clock_free else 0.0
            bounds = {"clock": reach} | dict.fromkeys((*REST[:2], *PUSH), 6.0)
            pairs += [(-bounds.get(key, 1.0), bounds.get(key, 1.0)) for key in self.own_keys]
        low, high = np.array(pairs).T
        return low, high

    def log_scale(self) -> float:
        """Sum of the log standard deviations of all whitened samples [nats]."""
        return sum(
            n.log_scale(s.breaks)
            for r, run in enumerate(self.runs)
            for n, s in zip(self.noise[r], run.samples, strict=True)
        )


def late(time: Array, out: Array, delay: Array) -> Array:
    """Outputs (sets, channels, rows) as a clock that is off by a delay (sets,) [s] shows them."""
    shifted = np.empty_like(out)
    for k, d in enumerate(delay):
        for c in range(out.shape[1]):
            shifted[k, c] = np.interp(time - d, time, out[k, c])
    return shifted
