"""What every way is given: recordings, the retuned machine, and what it leaves of each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.judging.model import tuned_machine
from corexy_fmi.engine.judging.prove import Proof, prove
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

Array = NDArray[np.float64]
AXES = ("x", "y")
LEARNED = 3000  # samples of a channel of a recording at most, to learn from


@dataclass(frozen=True, eq=False)
class Part:
    """One recording beside the retuned machine.

    ``left`` what is measured less what is simulated (rows, 2) [m] with the mean of each channel
    removed, NaN where no sample is; ``sigma`` (2,) [m] the noise; ``seen`` x, y as measured
    (rows, 2) [m]; ``said`` the machine's response.
    """

    role: str
    recording: Recording
    said: Recording
    left: Array
    sigma: Array
    seen: Array

    @property
    def time(self) -> Array:
        """Of the rows (rows,) [s]."""
        return self.recording.time

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Samples that are learned from (rows, 2): all, or evenly some where there are many."""
        out = np.zeros(self.left.shape, dtype=bool)
        for axis, column in enumerate(self.left.T):
            rows = np.flatnonzero(np.isfinite(column))
            out[rows[:: -(-len(rows) // LEARNED)], axis] = True
        return out

    @cached_property
    def travel(self) -> Array:
        """Motor angles (rows, 2) [rad]."""
        return np.column_stack([self.said["phi1_meas"], self.said["phi2_meas"]])


@dataclass(frozen=True, eq=False)
class Ground:
    """The retuned machine, its parts by role, and the held-out rms [m] as given and retuned."""

    machine: Machine
    train: tuple[Part, ...]
    holdout: tuple[Part, ...]
    given: float
    retuned: float
    noise: float


def rms(parts: Sequence[Array]) -> float:
    """Root mean square of all finite values, the mean of each column taken off first."""
    off = [a - np.nanmean(a, axis=0) for a in parts]
    return float(np.sqrt(np.nanmean(np.concatenate([o.ravel() for o in off]) ** 2)))


def _spread(proof: Proof, r: int, state: str, rows: int) -> Array:
    left = np.full((rows, 2), np.nan)
    run, found = proof.runs[r], proof.replays[state][r]
    for samples, errors in zip(run.samples, found.errors, strict=True):
        left[samples.index, AXES.index(samples.channel)] = errors
    return left


def ground(train: list[Recording], holdout: list[Recording], machine: Machine) -> Ground:
    """Retune the nominal parameters, as the engine does first, and replay everything."""
    runs, kept = make_runs(train, holdout, machine)
    fit = retune(bundled_layout(), machine, tuple(runs))
    tuned, used = tuned_machine(fit, machine.name), fit.problem.runs
    machines = {"nominal": machine, "retuned": tuned}
    proof = prove(bundled_layout(), machines, (*used, *kept), used, fit.problem.noise)
    parts, given = [], []
    for r, run in enumerate(proof.runs):
        rows, recording = len(run.recording.time), run.recording
        seen = np.column_stack([recording[a] for a in AXES])
        left, sigma = _spread(proof, r, "retuned", rows), np.array(proof.noise_std[r])
        parts.append(Part(run.role, recording, simulate(tuned, recording), left, sigma, seen))
        if run.role == "holdout":
            given.append(_spread(proof, r, "nominal", rows))
    late = tuple(p for p in parts if p.role == "holdout")
    return Ground(
        tuned, tuple(p for p in parts if p.role == "train"), late, rms(given),
        rms([p.left for p in late]), float(np.sqrt(np.mean([p.sigma**2 for p in late]))),
    )  # fmt: skip


def corrected(parts: Sequence[Part], corrections: Sequence[Array]) -> float:
    """Rms [m] of what corrections (rows, 2) [m] leave."""
    return rms([p.left - c for p, c in zip(parts, corrections, strict=True)])
