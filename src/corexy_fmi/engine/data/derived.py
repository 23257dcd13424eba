"""Channels that were computed from another one: differences of a position are no second sensor.

Their noise is that of the position, which a fit would count twice, and there is nearly none of it
at low frequencies, where it would trust them without limit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import correlate1d

from corexy_fmi.engine.evidence import Finding
from corexy_fmi.kernel.call import Array
from corexy_fmi.recording import Recording

# a channel, and what it may be computed from
PAIRS = (("vx", "x"), ("vy", "y"), ("ax", "x"), ("ax", "vx"), ("ay", "y"), ("ay", "vy"))
TAPS, ROWS = 16, 4000  # samples on either side that a filter may read; rows that are looked at
SIXTH = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0])  # difference in which noise is left
ALTERNATES = 0.5  # share of changes of sign in it from which on it is noise, not motion
LEFT = 0.1  # of the source's noise that goes through a filter, where a channel is that filter


def without_derived(recording: Recording) -> tuple[Recording, list[Finding]]:
    """The recording without channels that a linear filter of another one gives, noise and all, and
    what to say of them.
    """
    channels, findings = dict(recording.channels), []
    for channel, source in PAIRS:
        known = {channel, source} <= channels.keys()
        if known and is_derived(channels[channel], recording[source], recording.time):
            del channels[channel]
            findings.append(_finding(recording.name, channel, source))
    return replace(recording, channels=channels) if findings else recording, findings


def is_derived(values: Array, source: Array, time: Array) -> bool:
    """Whether a channel (n,) is a short linear filter of another one (n,) at the same times (n,)
    [s].

    The best filter of the source is taken off.  Of a sensor of its own at least the source's noise
    is left, which the filter lets through; of a channel that was computed, noise and all, nothing.
    """
    rows = _rows(values, source, time)
    if len(rows) < 4 * (2 * TAPS + 1):
        return False
    window = np.arange(-TAPS, TAPS + 1)
    seen = source[rows[:, None] + window]
    seen = np.c_[seen - seen.mean(1, keepdims=True), np.ones(len(rows))]
    weights = np.linalg.lstsq(seen, values[rows], rcond=None)[0]
    left = values[rows] - seen @ weights
    through = _noise(source, rows) * np.linalg.norm(weights[:-1])
    return bool(np.median(np.abs(left)) < LEFT * through)


def _rows(values: Array, source: Array, time: Array) -> np.ndarray:
    """Rows (m,) at which the channel and all of the source that a filter reads were sampled, on an
    even clock: as many as are needed, from the middle on.
    """
    steps = np.diff(time, prepend=2 * time[0] - time[1])
    sound = np.isfinite(source) & (np.abs(steps / np.median(steps) - 1) < 0.5)  # early ones, too
    whole = correlate1d(sound.astype(int), np.ones(2 * TAPS + 1, int), mode="constant")
    rows = np.flatnonzero((whole == 2 * TAPS + 1) & np.isfinite(values))
    first = max(0, (len(rows) - ROWS) // 2)
    return rows[first : first + ROWS]


def _noise(source: Array, rows: np.ndarray) -> float:
    """Deviation of what is white in a channel at rows (m,), by its sixth differences; 0 where these
    are no noise.
    """
    changes = np.convolve(source, SIXTH, mode="same")[rows]
    if np.mean(changes[1:] * changes[:-1] < 0) < ALTERNATES:
        return 0.0
    return float(np.median(np.abs(changes)) / np.linalg.norm(SIXTH))


def _finding(name: str, channel: str, source: str) -> Finding:
    text = f"{name}: channel {channel} was computed from {source}, noise and all"
    return Finding(text, f"Give {source} alone, or a sensor's own {channel}; it is left out here.")
