"""A run as a recording: what was played, what the board counted, what the tracker saw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import Log
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.recording import Recording

Array = NDArray[np.float64]
NEAR = 1e-7  # [s] rows nearer than this are one


def recording(
    name: str, log: Log, board: Board, tracker: Tracker | None, begin: float, about: dict[str, str]
) -> Recording:
    """Rows where segments meet, where the board reported and where the tracker sampled.

    ``phi1, phi2`` are exact: what the board played, for dc its references.  ``steps1, steps2`` are
    what it had emitted, to the nearest tick; ``phi1_meas, phi2_meas`` a dc board's encoders.  Time
    0 is ``begin`` [s] of the plan; a run that stopped early ends at the last instant at which the
    board followed its plan.  Raises InputError where nothing was played.
    """
    end = log.plan.time[-1] if log.complete else log.played()
    if end <= begin:
        raise InputError("the motion stopped before the recorded part began: nothing to record")
    time, channels = rows(log, board, tracker, begin, end)
    return Recording(name, time - begin, channels, {**about, **_about(log, tracker)})


def rows(
    log: Log, board: Board, tracker: Tracker | None, first: float, last: float
) -> tuple[Array, dict[str, Array]]:
    """Times (n,) [s] of the plan from ``first`` to ``last``, and every channel there (n,)."""
    reports, counts = _reports(log)
    stamps, places = _samples(log, board, tracker)
    marks = np.concatenate([log.plan.time, [first, last], reports, stamps])
    time = np.unique(marks[(marks >= first) & (marks <= last)])
    time = time[np.concatenate([[True], np.diff(time) > NEAR])]
    channels = {
        f"phi{m + 1}": np.interp(time, log.plan.time, log.plan.angles[:, m]) for m in (0, 1)
    }
    for m in (0, 1):
        seen = placed(time, reports, counts[:, m])
        if log.plan.scale.steps:
            channels[f"steps{m + 1}"] = seen
        else:
            channels[f"phi{m + 1}_meas"] = seen * log.plan.scale.angle(1)
    if tracker is not None:
        places = places if len(stamps) else np.empty((0, 2))
        for k, axis in enumerate("xy"):
            channels[axis] = placed(time, stamps, places[:, k])
    return time, channels


def _reports(log: Log) -> tuple[Array, Array]:
    """Times (n,) of the plan and counts (n, 2) that the board reported."""
    scale = log.plan.scale
    time = np.array([(tick - log.start) * scale.tick for tick, _ in log.reports])
    return time, np.array([counts for _, counts in log.reports], dtype=float).reshape(-1, 2)


def _samples(log: Log, board: Board, tracker: Tracker | None) -> tuple[Array, Array]:
    """Times (n,) of the plan and x, y (n, 2) from the tracker, through both clocks."""
    if tracker is None or not tracker.samples:
        return np.empty(0), np.empty((0, 2))
    host, places = tracker.aligned()
    offset, rate = board.clock.fit()
    return offset + rate * host - log.start * log.plan.scale.tick, places


def placed(rows: Array, time: Array, values: Array) -> Array:
    """Samples in their rows, blank elsewhere."""
    column = np.full(len(rows), np.nan)
    inside = (time >= rows[0] - NEAR) & (time <= rows[-1] + NEAR)
    where = np.clip(np.searchsorted(rows, time[inside] - NEAR), 0, len(rows) - 1)
    near = np.abs(rows[where] - time[inside]) <= NEAR
    column[where[near]] = values[inside][near]
    return column


def _about(log: Log, tracker: Tracker | None) -> dict[str, str]:
    """Metadata: how the run went."""
    lines = {
        "plant": "board",
        "commanded": f"{log.plan.counts[0]} {log.plan.counts[1]}",
        "counted": f"{log.counts[0]} {log.counts[1]}",
        "run": log.trouble or "complete",
        "link": f"frames_bad={log.frames_bad} sent_again={log.sent_again}",
    }
    if np.isfinite(log.buffered):
        lines["host"] = f"least_buffered={log.buffered!r} longest_pause={log.pause!r}"
    if tracker is not None:
        lines["tracker"] = f"samples={len(tracker.samples)} bad={tracker.bad}"
        lines["clock"] = "free"  # a latency common to all samples cannot be seen
    return lines
