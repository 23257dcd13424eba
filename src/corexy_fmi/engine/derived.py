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
LEFT = 0.1  # of a channel's noise that a filter of its source leaves, where it is one


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

    The best filter of the source is taken off.  Two sensors have noise of their own, which stays;
    of one that was computed nothing stays.  Channels without noise tell nothing.
    """
    rows = _rows(values, source, time)
    if len(rows) < 4 * (2 * TAPS + 1):
        return False
    window = np.arange(-TAPS, TAPS + 1)
    seen = source[rows[:, None] + window]
    seen = np.c_[seen - seen.mean(1, keepdims=True), np.ones(len(rows))]
    filtered = seen @ np.linalg.lstsq(seen, values[rows], rcond=None)[0]
    whole, left = _sixth(values[rows], rows), _sixth(values[rows] - filtered, rows)
    changes = np.mean(whole[1:] * whole[:-1] < 0) if len(whole) > TAPS else 0.0
    return bool(changes > ALTERNATES and np.median(np.abs(left)) < LEFT * np.median(np.abs(whole)))


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


def _sixth(values: Array, rows: np.ndarray) -> Array:
    """Sixth differences of what was taken at rows (m,), where seven of them follow one another."""
    length = len(SIXTH)
    if len(rows) < length:
        return np.zeros(0)
    together = rows[length - 1 :] - rows[: 1 - length] == length - 1
    return np.asarray(np.convolve(values, SIXTH, mode="valid")[together], dtype=float)


def _finding(name: str, channel: str, source: str) -> Finding:
    text = f"{name}: channel {channel} was computed from {source}, noise and all"
    return Finding(text, f"Give {source} alone, or a sensor's own {channel}; it is left out here.")
