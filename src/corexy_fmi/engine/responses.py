"""Responses: how the residuals of a fit that is not whitened change by each probe.

Probes of motors, axes and belts are replayed with those commands, or with dc on the course that
the motors took; what a sensor, a tool, a frame or a bridge that turns would show is added to the
outputs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.fit import Fit, Mapper
from corexy_fmi.engine.imposed import Course, courses
from corexy_fmi.engine.noise import quick_noise
from corexy_fmi.engine.outputs import Added, outputs
from corexy_fmi.engine.probe_laws import TONE, Motion
from corexy_fmi.engine.probes import Probe, probes
from corexy_fmi.kernel.call import Array, Excitation

SIZE = 2.0  # of a probe, in the noise of the quieter of x and y
USUAL, VOLTS = 1e-5, 0.02  # [m] of that noise where neither is measured; [V] of a probe


@dataclass(frozen=True, eq=False)
class Response:
    """A place, the state and word of one probe there, what it changes (samples,), in single
    precision for its room, and what it costs [nats] that the data themselves chose it out of many.
    """

    location: str
    state: str
    word: str
    change: Array
    chosen: float = 0.0


def moved(fit: Fit, probe: Probe, size: float, held: Sequence[Course] = ()) -> Response:
    """The whole response to a probe: a replay with such commands, or voltages; where those do not
    hold a motor, on the courses on which it is ``held``.
    """
    most = max(float(np.abs(v).max()) for pair in probe.turns for v in pair) or 1.0
    radius = fit.problem.machine.parameters["pulley_radius"]
    scale = (VOLTS if probe.volts else size / radius) / most
    if held and not probe.volts and probe.location.startswith("motor"):
        rest = [{"x": radius * (a + b) / 2, "y": radius * (a - b) / 2} for a, b in probe.turns]
        change = scale * added(fit, rest)
    elif held and not probe.volts:
        turns = [(scale * a, scale * b) for a, b in probe.turns]
        forced = probe.location in ("x", "y")
        found = [course.off(pair, forced) for course, pair in zip(held, turns, strict=True)]
        change = added(fit, [off for off, _ in found]) + _pulled(fit, [v for _, v in found])
    else:
        change = _replayed(fit, probe.turns, probe.volts, scale)
    chosen = float(np.log(len(fit.residual))) if probe.word.startswith(TONE) else 0.0
    change = (change / scale).astype(np.float32)
    return Response(probe.location, probe.state, probe.word, change, chosen)


def _pulled(fit: Fit, volts: list[tuple[Array, Array]]) -> Array:
    """Change of the residual (samples,) by voltages on the motors, told from small ones: friction
    lets a loop answer large ones otherwise.
    """
    most = max(float(np.abs(v).max()) for pair in volts for v in pair)
    share = min(VOLTS / max(most, 1e-30), 1.0)
    return _replayed(fit, volts, True, share) / share


def _replayed(fit: Fit, pairs: Sequence[tuple[Array, Array]], volts: bool, scale: float) -> Array:
    """Change of the residual (samples,) by commands, or voltages, that are off by so much of these
    pairs, one for each run.
    """
    runs = []
    for run, pair in zip(fit.problem.runs, pairs, strict=True):
        e = run.excitation
        a, b = (scale * v for v in pair)
        if volts and e.mode == "closed_loop":
            a, b = (_reference(v, e) for v in (a, b))
        runs.append(replace(run, excitation=replace(e, input1=e.input1 + a, input2=e.input2 + b)))
    off = replace(fit.problem, runs=tuple(runs))
    errors = [off.errors(fit.u[None], r) for r in range(len(runs))]
    white = np.concatenate([fit.problem.whiten(e, r)[0] for r, e in enumerate(errors)])
    return np.asarray(white - fit.residual[: len(white)])


def _reference(volts: Array, e: Excitation) -> Array:
    """The reference (rows,) [rad] by which a loop adds these volts: kp r + kd w r' = V."""
    rate = e.kd * e.rate_weight / float(np.median(np.diff(e.time)))
    if rate <= e.kp:  # such a filter would not settle: its steady gain
        return volts / max(e.kp, 1e-12)
    return np.asarray(lfilter([0.0, 1 / rate], [1.0, e.kp / rate - 1.0], volts))


def added(fit: Fit, runs: list[dict[str, Array]]) -> Array:
    """Change of the residual (samples,) by what is added to the channels of each run."""
    parts = []
    for r, (run, channels) in enumerate(zip(fit.problem.runs, runs, strict=True)):
        nothing = np.zeros(len(run.excitation.time))
        off = [-channels.get(s.channel, nothing)[None, s.rows] for s in run.samples]
        parts.append(fit.problem.whiten(off, r)[0])
    return np.concatenate(parts)


def quietest(fit: Fit) -> float:
    """Standard deviation [m] of the quickest noise of x and y, if any."""
    sizes = [quick_noise(s) for run in fit.problem.runs for s in run.samples if s.channel in "xy"]
    return min(sizes, default=USUAL)


def responses(fit: Fit, runs: list[Motion], mapper: Mapper) -> Iterator[list[Response]]:
    """Responses of a plain fit to all probes, a kind of place at a time: they take some room."""
    size = SIZE * quietest(fit)

    def shown(what: Added) -> Response:
        location, state, word, off = what
        return Response(location, state, word, added(fit, off).astype(np.float32))

    yield [*mapper(shown, outputs(fit, runs))]
    held = courses(fit) if fit.problem.machine.drive == "dc" else []
    for kind in probes(fit, runs):
        yield [*mapper(lambda probe: moved(fit, probe, size, held), kind)]
