"""Recordings as the engine sees them: what drove a run, and what was measured when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corexy_fmi.engine.data.loops import Loops, find_loops
from corexy_fmi.engine.data.steps import told_before
from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import excitation

GAP = 5 * 0.07  # [s] left out before a split: five settling times of x in P1 (PHYSICS 5)
FEWEST = 20  # samples, which a channel that counts exceeds
LONG = 160_000  # rows beyond which recordings are fitted in excerpts and replayed without a fit
LATE, SCATTER = 0.5, 5.0  # of the usual time between samples; of its median deviation
OUTPUT_OF = {
    "x": "x",
    "y": "y",
    "vx": "vx",
    "vy": "vy",
    "ax": "ax",
    "ay": "ay",
    "phi1_meas": "phi1",
    "phi2_meas": "phi2",
}


@dataclass(frozen=True, eq=False)
class Samples:
    """One measured channel of a run: where it took samples and what they were.

    ``index`` (m,) rows of the run, ``value`` (m,) in the channel's unit; ``breaks`` (m,) is True
    where a sample does not follow the one before it at the channel's usual spacing in time: a row
    that is missing between two of its samples parts them no more than it delays the second.
    """

    channel: str
    index: np.ndarray
    value: Array
    breaks: np.ndarray

    @staticmethod
    def of(channel: str, values: Array, time: Array, keep: np.ndarray) -> Samples:
        """The finite samples of a channel (n,) of a recording at time (n,) [s], rows kept (n,)."""
        index = np.flatnonzero(np.isfinite(values) & keep)
        return Samples(channel, index, values[index], parted(time[index]))

    @property
    def of_motor(self) -> bool:
        """Whether it is a motor's encoder."""
        return self.channel.startswith("phi")

    @cached_property
    def rows(self) -> np.ndarray | slice:
        """The same as ``index``; a slice, which copies nothing, where no row is left out."""
        first, last = (int(self.index[0]), int(self.index[-1])) if len(self.index) else (0, -1)
        return slice(first, last + 1) if last - first + 1 == len(self.index) else self.index

    def without(self, drop: np.ndarray) -> Samples:
        """The same channel without some of its samples, (m,) True where dropped."""
        kept = np.flatnonzero(~drop)
        torn = np.diff(kept, prepend=kept[:1] - 1) > 1
        return Samples(self.channel, self.index[kept], self.value[kept], self.breaks[kept] | torn)


def parted(time: Array) -> np.ndarray:
    """True (m,) at the first sample, and where one comes later than it usually does; stamps that
    scatter part nothing within their scatter.
    """
    gaps = np.diff(time)
    if not len(gaps):
        return np.ones(len(time), dtype=bool)
    late = gaps / np.median(gaps) - 1
    return np.r_[True, late > max(LATE, SCATTER * float(np.median(np.abs(late))))]


def even(errors: Array, time: Array) -> tuple[Array, float]:
    """Errors on an even clock, their mean aside, 0 where no sample was taken; its spacing [s].

    Put together without that, what was not taken would shift every tone upwards by its share.
    """
    spacing = float(np.median(np.diff(time)))
    slots = np.rint((time - time[0]) / spacing).astype(int)
    result = np.zeros(slots[-1] + 1)
    result[slots] = errors - errors.mean()
    return result, spacing


@dataclass(frozen=True, eq=False)
class Run:
    """One recording, or the part of it in use: excitation, samples, and its role; ``pace`` is the
    fastest speed [m/s] that is commanded where it begins in motion, else 0; ``curved``: its angles
    are led smoothly through the rows that command them.
    """

    name: str
    role: str  # "train" or "holdout"
    recording: Recording
    excitation: Excitation
    samples: tuple[Samples, ...]
    pace: float = 0.0
    curved: bool = False

    @property
    def outputs(self) -> tuple[str, ...]:
        """Kernel outputs of the measured channels."""
        return tuple(OUTPUT_OF[s.channel] for s in self.samples)

    @property
    def count(self) -> int:
        """Number of scalar samples."""
        return sum(len(s.index) for s in self.samples)

    def spacing(self, samples: Samples) -> float:
        """Usual time [s] between the samples of a channel that has two or more."""
        return float(np.median(np.diff(self.recording.time[samples.index])))

    @cached_property
    def loops(self) -> Loops | None:
        """The repeats of the commanded motion, if there are any."""
        return find_loops(self.excitation)

    @property
    def moving(self) -> bool:
        """Whether the run begins in motion."""
        return self.pace > 0

    @property
    def clock_free(self) -> bool:
        """Whether the samples' clock has an unknown offset against that of the inputs."""
        return self.recording.metadata.get("clock") == "free"

    @property
    def zeroed(self) -> tuple[str, ...]:
        """Channels whose zero is that of the inputs, as of a loop's own sensor: no offset."""
        told = self.recording.metadata.get("zero", "")
        return tuple(name.strip() for name in told.split(",") if name.strip())

    def with_samples(self, samples: tuple[Samples, ...]) -> Run:
        """The same run judged on other samples."""
        return replace(self, samples=samples)


def make_run(
    recording: Recording, machine: Machine, role: str, keep: np.ndarray | None = None
) -> Run:
    """A run of a recording; ``keep`` (n,) are the rows whose samples count."""
    rows = np.ones(len(recording.time), dtype=bool) if keep is None else keep
    dc = machine.drive == "dc"
    names = [c for c in recording.measured if c in OUTPUT_OF and (dc or not c.startswith("phi"))]
    found = [Samples.of(c, recording.channels[c], recording.time, rows) for c in names]
    samples = tuple(s.without(told_before(s.value)) if s.of_motor else s for s in found)
    samples = tuple(s for s in samples if len(s.index) > FEWEST)
    return Run(recording.name, role, recording, excitation(machine, recording), samples)


def judged(run: Run, others: Sequence[Run]) -> Run:
    """The run without channels that no run of some others measured."""
    known = {s.channel for other in others for s in other.samples}
    return run.with_samples(tuple(s for s in run.samples if s.channel in known))


def split_in_time(
    recording: Recording, machine: Machine, gap: float, share: float = 0.3
) -> tuple[Run, Run]:
    """The first part for fitting and the last ``share`` for judging, ``gap`` [s] left out.

    Both run from the recording's start, so that the later part's state is the simulated one.
    """
    time = recording.time
    border = time[-1] - share * (time[-1] - time[0])
    early, late = (
        time <= border,
        time > min(border + gap, time[-1] - 0.1 * share * (time[-1] - time[0])),
    )
    return make_run(recording, machine, "train", early), make_run(
        recording, machine, "holdout", late
    )
