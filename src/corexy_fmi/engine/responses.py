"""Responses: how the whitened residuals of a fit change by each probe (rows,), retuning taken off.

Probes of motors, axes and belts are replayed with those commands; what a sensor, a tool, a frame
or a bridge that turns would show is added to the simulated outputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.fit import Fit, Mapper
from corexy_fmi.engine.noise import quick_noise
from corexy_fmi.engine.outputs import Added, outputs
from corexy_fmi.engine.probe_laws import TONE, Motion
from corexy_fmi.engine.probes import Probe, probes
from corexy_fmi.kernel.call import Array, Excitation

SIZE = 2.0  # of a probe, in the noise of the quieter of x and y
USUAL, VOLTS = 1e-5, 0.02  # [m] of that noise where neither is measured; [V] of a probe
TOGETHER = 32  # responses that are projected at once: as many in double precision take some room


@dataclass(frozen=True, eq=False)
class Response:
    """A place, the state and word of one probe there, what it changes (samples + size,), and what
    it costs [nats] that the data themselves chose it out of many.
    """

    location: str
    state: str
    word: str
    change: Array
    chosen: float = 0.0


def moved(fit: Fit, probe: Probe, size: float) -> Response:
    """The whole response to a probe: a replay with such commands, or voltages; where those do not
    hold a motor, where the end-effector would rest.
    """
    radius = fit.problem.machine.parameters["pulley_radius"]
    most = max(float(np.abs(v).max()) for pair in probe.turns for v in pair) or 1.0
    if fit.problem.machine.drive == "dc" and not probe.volts:
        rest = [{"x": radius * (a + b) / 2, "y": radius * (a - b) / 2} for a, b in probe.turns]
        change = added(fit, rest)
    else:
        scale = (VOLTS if probe.volts else size / radius) / most
        change = _replayed(fit, probe, scale) / scale
    chosen = float(np.log(len(fit.residual))) if probe.word.startswith(TONE) else 0.0
    return Response(probe.location, probe.state, probe.word, change, chosen)


def _off(whole: Sequence[Response], q: Array) -> list[Response]:
    """What is left of responses beside q; in single precision, for its room."""
    changes = np.array([r.change for r in whole])
    changes -= (changes @ q) @ q.T
    left = changes.astype(np.float32)
    return [replace(r, change=row) for r, row in zip(whole, left, strict=True)]


def _each(
    items: Sequence[Any], respond: Callable[[Any], Response], q: Array, mapper: Mapper
) -> list[Response]:
    """What is left beside q of the responses to probes, some at a time."""
    parts = (items[n : n + TOGETHER] for n in range(0, len(items), TOGETHER))
    return [left for part in parts for left in _off([*mapper(respond, part)], q)]


def _replayed(fit: Fit, probe: Probe, scale: float) -> Array:
    """Change of the residual (samples + size,) by commands that are off by so much of a probe."""
    runs = []
    for run, pair in zip(fit.problem.runs, probe.turns, strict=True):
        e = run.excitation
        a, b = (scale * v for v in pair)
        if probe.volts and e.mode == "closed_loop":
            a, b = (_reference(v, e) for v in (a, b))
        runs.append(replace(run, excitation=replace(e, input1=e.input1 + a, input2=e.input2 + b)))
    count, change = sum(run.count for run in runs), np.zeros(len(fit.residual))
    change[:count] = replace(fit.problem, runs=tuple(runs)).residual(fit.u[None])[0, :count]
    change[:count] -= fit.residual[:count]
    return change


def _reference(volts: Array, e: Excitation) -> Array:
    """The reference (rows,) [rad] by which a loop adds these volts: kp r + kd w r' = V."""
    rate = e.kd * e.rate_weight / float(np.median(np.diff(e.time)))
    if rate <= e.kp:  # such a filter would not settle: its steady gain
        return volts / max(e.kp, 1e-12)
    return np.asarray(lfilter([0.0, 1 / rate], [1.0, e.kp / rate - 1.0], volts))


def added(fit: Fit, runs: list[dict[str, Array]]) -> Array:
    """Change of the residual (samples + size,) by what is added to the channels of each run."""
    parts = []
    for r, (run, channels) in enumerate(zip(fit.problem.runs, runs, strict=True)):
        nothing = np.zeros(len(run.excitation.time))
        off = [-channels.get(s.channel, nothing)[None, s.rows] for s in run.samples]
        parts.append(fit.problem.whiten(off, r)[0])
    change = np.zeros(len(fit.residual))
    change[: sum(map(len, parts))] = np.concatenate(parts)
    return change


def quietest(fit: Fit) -> float:
    """Standard deviation [m] of the quickest noise of x and y, if any."""
    sizes = [quick_noise(s) for run in fit.problem.runs for s in run.samples if s.channel in "xy"]
    return min(sizes, default=USUAL)


def responses(fit: Fit, runs: list[Motion], q: Array, mapper: Mapper) -> Iterator[list[Response]]:
    """Responses to all probes, what retuning can do (its orthonormal ``q``) taken off, a kind of
    place at a time: they take some room.
    """
    size = SIZE * quietest(fit)

    def shown(what: Added) -> Response:
        location, state, word, off = what
        return Response(location, state, word, added(fit, off))

    yield _each(outputs(fit, runs), shown, q, mapper)
    for kind in probes(fit, runs):
        yield _each(kind, lambda probe: moved(fit, probe, size), q, mapper)
