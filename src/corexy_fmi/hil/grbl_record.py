"""A run on a GRBL controller as a recording: what it drove by its plan, what a tracker saw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_drive import Log
from corexy_fmi.hil.grbl_moves import Grid
from corexy_fmi.hil.grbl_timing import Timeline
from corexy_fmi.hil.record import NEAR, placed
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.recording import Recording

Array = NDArray[np.float64]
ROWS = 1e-3  # [s] between rows of a recording
EARLY, LATE, COARSE = -0.3, 1.0, 5e-3  # [s] around the first guess, where the start is looked for
ROUNDS, STEP = 8, 1e-5  # of the fit; [s] and relative, for its slopes
FEW, DRIFT_SPAN = 3, 5.0  # reports below which nothing is fitted; [s] from which the rate is


@dataclass(frozen=True)
class Fit:
    """Host time = start + time of the controller / rate; ``gap`` [steps] is what nine
    of ten of the ``reports`` keep to what was foreseen; a late host spoils single ones."""

    start: float
    rate: float
    gap: float
    reports: int

    def time(self, host: Array) -> Array:
        """The controller's time (n,) [s] of host times (n,) [s]."""
        result: Array = (host - self.start) * self.rate
        return result


def fit(
    log: Log, line: Timeline, grid: Grid, guess: float, until: float,
    offset: tuple[float, float] | None = None,
) -> Fit:  # fmt: skip
    """The start, near a guess [s], at which the reports up to ``until`` [s] lie on the timeline.

    A report is taken to be from the middle between its `?` and its arrival; reports of work
    positions need the work ``offset`` [mm].
    """
    seen_at = [(h, h.report.place(offset)) for h in log.reports if guess + EARLY < h.sent < until]
    rows = [(0.5 * (h.sent + h.heard), *place) for h, place in seen_at if place is not None]
    table = np.array(rows).reshape(-1, 3)
    if len(table) < FEW:
        return Fit(guess, 1.0, float("nan"), len(table))
    host, seen = table[:, 0], table[:, 1:] * grid.per_mm

    starts = np.arange(guess + EARLY, guess + LATE, COARSE)
    misses = [np.sum((line.place(host - start) - seen) ** 2) for start in starts]
    start, rate = _closest(line, host, seen, float(starts[int(np.argmin(misses))]))
    gaps = np.hypot(*(line.place((host - start) * rate) - seen).T)
    return Fit(start, rate, float(np.quantile(gaps, 0.9)), len(table))


def _closest(line: Timeline, host: Array, seen: Array, start: float) -> tuple[float, float]:
    """Start and rate of least squares, by Gauss and Newton; the rate only where it can be told."""
    count = 2 if np.ptp(host) >= DRIFT_SPAN else 1
    found = np.array([start, 1.0])

    def miss(at: Array) -> Array:
        return (line.place((host - at[0]) * at[1]) - seen).ravel()

    for _ in range(ROUNDS):
        slopes = [
            (miss(found + STEP * axis) - miss(found - STEP * axis)) / (2 * STEP)
            for axis in np.eye(2)[:count]
        ]
        change = np.linalg.lstsq(np.column_stack(slopes), -miss(found), rcond=None)[0]
        found[:count] += change
    return float(found[0]), float(found[1])


def recording(
    name: str, log: Log, line: Timeline, grid: Grid, radius: float, clock: Fit,
    tracker: Tracker | None, about: dict[str, str],
) -> Recording:  # fmt: skip
    """Rows at 1 kHz, where the plan changes, and where the tracker sampled.

    ``phi1, phi2`` [rad] are what the controller drove by its own plan, to a step; ``x, y`` [m] only
    what a tracker saw.  A run that stopped early ends at its last report in motion.  Raises
    InputError where the motion had not begun.
    """
    end = line.end
    if log.trouble:
        moving = [h.heard for h in log.reports if h.report.state == "Run"]
        end = min(end, float(clock.time(np.array(moving[-1:]))[0])) if moving else 0.0
    if end <= 0:
        raise InputError("the motion stopped before the recorded part began: nothing to record")
    host, places = tracker.aligned() if tracker is not None else (np.empty(0), np.empty((0, 2)))
    stamps = clock.time(host)
    time = _times(end, line, stamps)
    x, y = grid.metres(line.place(time)).T
    channels = {"phi1": (x + y) / radius, "phi2": (x - y) / radius}
    if tracker is not None:
        for k, axis in enumerate("xy"):
            channels[axis] = placed(time, stamps, places[:, k])
    return Recording(name, time, channels, {**about, **_about(log, line, grid, clock, tracker)})


def _times(end: float, line: Timeline, stamps: Array) -> Array:
    marks = np.concatenate([np.arange(0, end, ROWS), line.begins, stamps, [end]])
    time = np.unique(marks[(marks >= 0) & (marks <= end)])
    return time[np.concatenate([[True], np.diff(time) > NEAR])]


def _about(
    log: Log, line: Timeline, grid: Grid, clock: Fit, tracker: Tracker | None
) -> dict[str, str]:
    """Metadata: how the run went, and how well its timing is known."""
    lines = {
        "run": log.trouble or "complete",
        "phi": "by the controller's own plan, foreseen from its settings; not read back",
        "timing": f"reports={clock.reports} gap={clock.gap / grid.per_mm / 1e3!r} "
                  f"rate={clock.rate!r} duration={line.end!r}",
        "clock": "free",  # half a round trip of `?` and the tracker's latency cannot be seen
    }  # fmt: skip
    if tracker is not None:
        lines["tracker"] = f"samples={len(tracker.samples)} bad={tracker.bad}"
    return lines
