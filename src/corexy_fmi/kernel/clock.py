"""A sensor's clock: what was sampled at another time than its stamp says, read off a response.

The kernel steps from row to row of a recording; laws of the port ``clock`` say when a sample with a
row's stamp was really taken, and the response is read there, by cubic Hermite interpolation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.kernel.ports import HOST
from corexy_fmi.kernel.trace import argument_names

Array = NDArray[np.float64]
SENSED = frozenset({"x", "y", "ax", "ay"})


@lru_cache(maxsize=32)
def clocked(layout: Layout) -> tuple[Instance, ...]:
    """The instances that have a law at this port."""
    return tuple(i for i in layout.instances if any(law.port in HOST for law in i.effect.laws))


@lru_cache(maxsize=32)
def _sizes(layout: Layout) -> tuple[NDArray[np.intp], Array]:
    """Places of the parameters that switch these on, and their neutral values."""
    pairs = [
        (i.parameter + k, p.neutral)
        for i in clocked(layout)
        for k, p in enumerate(i.effect.parameters)
        if p.size
    ]
    places, neutral = zip(*pairs, strict=True)
    return np.array(places, dtype=np.intp), np.array(neutral)


def taken(instances: Sequence[Instance], vector: Array, time: Array) -> Array:
    """Times [s] (n,) at which samples stamped ``time`` (n,) were taken.

    ``vector`` is the kernel's parameter vector of one set.
    """
    stamp = time - time[0]
    for instance in instances:
        names = [p.name for p in instance.effect.parameters]
        values = dict(zip(names, vector[instance.parameter :].tolist(), strict=False))
        if all(values[p.name] == p.neutral for p in instance.effect.sizes):
            continue
        for law in instance.effect.laws:
            if law.port in HOST:
                given: Mapping[str, object] = {**values, "stamp": stamp}
                read = {n: given[n] for n in argument_names(law.function)}
                stamp = np.asarray(law.function(**read)["stamp"])
    return np.asarray(time[0] + stamp)


def resampled(time: Array, values: Array, at: Array) -> Array:
    """Values (channels, n) at other times (n,), cubic between rows; the ends are held."""
    if len(time) < 3:
        return values
    at = np.clip(at, time[0], time[-1])
    n = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    step = time[n + 1] - time[n]
    part = (at - time[n]) / step
    with np.errstate(over="ignore", invalid="ignore"):  # a run that broke down is not finite
        slope = np.gradient(values, time, axis=1)
        rise = values[:, n + 1] - values[:, n]
        early, late = step * slope[:, n] - rise, rise - step * slope[:, n + 1]
        bend = (1 - part) * early + part * late
        return np.asarray(values[:, n] + part * (rise + (1 - part) * bend))


def restamp(
    layout: Layout, parameters: Array, time: Array, channels: Sequence[str], out: Array
) -> None:
    """Read what the sensor reports of each set where its clock was; ``out`` is changed in place.

    ``parameters`` (sets, layout.parameters), ``out`` (sets, channels, n).
    """
    instances = clocked(layout)
    if not instances or SENSED.isdisjoint(channels):
        return
    places, neutral = _sizes(layout)
    values = parameters.take(places, axis=1)
    if values.tobytes() == neutral.tobytes() * len(parameters):
        return
    sensed = [k for k, name in enumerate(channels) if name in SENSED]
    for n in np.flatnonzero((values != neutral).any(axis=1)):
        out[n, sensed] = resampled(time, out[n, sensed], taken(instances, parameters[n], time))
