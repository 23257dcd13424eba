"""A recording as the input array of `fmpy.simulate_fmu`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.recording import Recording, inputs, with_lost_rows
from corexy_fmi.recording.record import ANGLES

BENT = 1e-9  # [1] change of slope, relative to the largest slope, that makes a row a bend


def fmpy_signals(recording: Recording) -> NDArray[np.void]:
    """Structured array (rows,): time [s] and a recording's angles with their rates, voltages.

    The rates are the inputs phi1_rate, phi2_rate [rad/s]: fmpy 0.3.32 cannot set input derivatives
    (its option wants nine inputs).  fmpy takes what is on the left of a communication point, unless
    that point stands twice in the array: so every bend stands twice here, and one row stands before
    the start.  Rows that were lost are put back.
    """
    recording = with_lost_rows(recording)
    columns = inputs(recording)
    time = recording.time
    values = np.column_stack(list(columns.values()))
    slopes = np.diff(values, axis=0) / np.diff(time)[:, None]
    before, after = np.vstack([slopes[:1], slopes]), np.vstack([slopes, 0 * slopes[:1]])
    bent = np.abs(after - before).max(axis=1) > BENT * np.abs(slopes).max(initial=1e-300)
    bent[0] = True
    first = time[1] - time[0]
    double = np.repeat(np.arange(len(time)), 1 + bent)
    right = np.concatenate([[False], double[1:] == double[:-1]])  # the second of two equal rows
    table = {"time": np.concatenate([[time[0] - first], time[double]])}
    for k, name in enumerate(columns):
        table[name] = np.concatenate([values[:1, k] - first * slopes[:1, k], values[double, k]])
    sides = np.where(right[:, None], after[double], before[double])
    for k, name in enumerate(columns):
        if name in ANGLES:
            table[f"{name}_rate"] = np.concatenate([slopes[:1, k], sides[:, k]])
    return _structured(table)


def _structured(table: dict[str, NDArray[np.float64]]) -> NDArray[np.void]:
    array = np.empty(len(table["time"]), dtype=[(name, np.float64) for name in table])
    for name, column in table.items():
        array[name] = column
    return array
