"""The output-error problem: whitened residuals of a hypothesis over runs, and their Jacobian.

Offsets of the channels are projected out, so that they cost no unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np

from corexy_fmi.engine.fitting.lanes import Lanes
from corexy_fmi.engine.fitting.micro_step import SHORTEST, damped, damps, needed, own_step
from corexy_fmi.engine.fitting.noise import Noises
from corexy_fmi.engine.fitting.parametrisation import Parametrisation
from corexy_fmi.engine.fitting.slopes import linearised
from corexy_fmi.engine.fitting.whitening import Filter
from corexy_fmi.kernel.call import Array, Excitation, run_lanes
from corexy_fmi.kernel.spare import shared


@dataclass(frozen=True, eq=False)
class Problem(Parametrisation):
    """A machine, runs with their noise, and a hypothesis.

    ``noise`` holds one `Noise` for each channel of each run; no louder one is taken than
    ``ceiling``, where given.
    ``limit`` is the micro-step [s], one for all sets of a fit: the machine file's, or what the
    effects need where they begin; 0, each machine's own, where pinned.  ``coarse`` lengthens
    both.  Where the hypothesis damps belts, it is halved as the damping at hand asks.
    """

    noise: Noises = field(kw_only=True)
    ceiling: Noises | None = field(default=None, kw_only=True)
    coarse: float = field(default=1.0, kw_only=True)
    limit: float = field(init=False)

    def __post_init__(self) -> None:
        """The unknowns, and the micro-step that they are fitted at."""
        super().__post_init__()
        object.__setattr__(self, "limit", 0.0 if self.pinned else self._limit())

    def _limit(self) -> float:
        own = own_step(self.layout, self.base.tobytes(), self.machine.stage, self.machine.drive)
        least = needed(self.layout, self.machine, self.base, self.hypothesis, self.coarse)
        return max(min(self.coarse * own, least), own / SHORTEST)

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
        result[:, samples:] = (u - self.prior[0]) @ self.root.T
        return result

    @cached_property
    def parts(self) -> list[slice]:
        """Where the samples of each run stand in a residual."""
        return [
            slice(*ends) for ends in pairwise(accumulate((r.count for r in self.runs), initial=0))
        ]

    def linearised(
        self, u: Array, borrowed: Array | None = None, stretch: float = 1.0
    ) -> tuple[Array, Array]:
        """Residual (samples + size,) at u (size,) and its derivative (`slopes.py`)."""
        return linearised(self, u, borrowed, stretch)

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
