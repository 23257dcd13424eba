"""Responses: how the residuals of a fit that is not whitened change by each probe.

Probes of motors, axes, belts and the frame are replayed with those commands, or with dc on the
course that the motors took; what a sensor, a tool or a bridge that turns would show is added to the
outputs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.fitting.noise import quick_noise
from corexy_fmi.engine.places.imposed import Course, courses
from corexy_fmi.engine.places.outputs import Added, outputs
from corexy_fmi.engine.places.probe_laws import TONE, Motion
from corexy_fmi.engine.places.probes import Probe, probes
from corexy_fmi.kernel.call import LANES, Array, Excitation

SIZE = 2.0  # of a probe, in the noise of the quieter of x and y
FAR = 1e15  # [noise] from which on a response broke down: single precision holds its square
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


def moved(
    fit: Fit, some: Sequence[Probe], size: float, held: Sequence[Course] = ()
) -> list[Response]:
    """The whole responses to probes that act alike: replays with such commands, or voltages; where
    those do not hold the motors, on the courses on which they are ``held``.
    """
    radius = fit.problem.machine.parameters["pulley_radius"]
    pairs = [np.array([p.turns[r] for p in some]).swapaxes(0, 1) for r in range(len(some[0].turns))]
    scale = (VOLTS if some[0].volts else size / radius) / _most(pairs, 1.0)
    small = [scale[:, None] * pair for pair in pairs]
    if held and not some[0].volts:
        forced = some[0].location in ("x", "y", "frame")
        found = [course.off(pair, forced) for course, pair in zip(held, small, strict=True)]
        change = added(fit, [off for off, _ in found]) + _pulled(fit, [v for _, v in found])
    else:
        change = _replayed(fit, small, some[0].volts)
    told = _single(change / scale[:, None])
    return [
        Response(p.location, p.state, p.word, row, _chosen(fit, p))
        for p, row in zip(some, told, strict=True)
    ]


def _single(changes: Array) -> Array:
    """Changes (sets, samples) in single precision, 0 where one broke down."""
    whole = np.abs(changes).max(axis=1, initial=0.0, keepdims=True) < FAR
    return np.where(whole, changes, 0.0).astype(np.float32)


def _chosen(fit: Fit, probe: Probe) -> float:
    """What it costs [nats] that the data themselves chose a probe."""
    return float(np.log(len(fit.residual))) if probe.word.startswith(TONE) else 0.0


def _most(pairs: Sequence[Array], nothing: float) -> Array:
    """The greatest size (sets,) in pairs (2, sets, rows) of all runs; ``nothing`` for zero."""
    most = np.max([np.abs(pair).max(axis=(0, 2)) for pair in pairs], axis=0)
    return np.where(most > 0, most, nothing)


def _pulled(fit: Fit, volts: list[Array]) -> Array:
    """Change of the residual (sets, samples) by voltages on the motors, told from small ones:
    friction lets a loop answer large ones otherwise.
    """
    share = np.minimum(VOLTS / _most(volts, VOLTS), 1.0)[:, None]
    return _replayed(fit, [share * pair for pair in volts], True) / share


def _replayed(fit: Fit, pairs: Sequence[Array], volts: bool) -> Array:
    """Change of the residual (sets, samples) by commands, or voltages, that are off by these pairs
    (2, sets, rows), one for each run.
    """
    white = []
    for r, (run, off) in enumerate(zip(fit.problem.runs, pairs, strict=True)):
        e = run.excitation
        given = _reference(off, e) if volts and e.mode == "closed_loop" else off
        inputs = np.array([e.input1, e.input2])[:, None] + given
        sets = np.repeat(fit.u[None], inputs.shape[1], axis=0)
        white.append(fit.problem.whiten(fit.problem.errors(sets, r, inputs), r))
    told = np.concatenate(white, axis=1)
    return told - fit.residual[: told.shape[1]]


def _reference(volts: Array, e: Excitation) -> Array:
    """The reference (.., rows) [rad] by which a loop adds these volts: kp r + kd w r' = V."""
    rate = e.kd * e.rate_weight / float(np.median(np.diff(e.time)))
    if rate <= e.kp:  # such a filter would not settle: its steady gain
        return volts / max(e.kp, 1e-12)
    return np.asarray(lfilter([0.0, 1 / rate], [1.0, e.kp / rate - 1.0], volts))


def added(fit: Fit, runs: list[dict[str, Array]]) -> Array:
    """Change of the residual (sets, samples) by what is added (sets, rows) to the channels of each
    run.
    """
    sets = max((len(off) for channels in runs for off in channels.values()), default=1)
    parts = []
    for r, (run, channels) in enumerate(zip(fit.problem.runs, runs, strict=True)):
        nothing = np.zeros((sets, len(run.excitation.time)))
        off = [-channels.get(s.channel, nothing)[:, s.rows] for s in run.samples]
        parts.append(fit.problem.whiten(off, r))
    return np.concatenate(parts, axis=1)


def quietest(fit: Fit) -> float:
    """Standard deviation [m] of the quickest noise of x and y, if any."""
    sizes = [quick_noise(s) for run in fit.problem.runs for s in run.samples if s.channel in "xy"]
    return min(sizes, default=USUAL)


def responses(fit: Fit, runs: list[Motion], mapper: Mapper) -> Iterator[list[Response]]:
    """Responses of a plain fit to all probes, a kind of place at a time: they take some room."""
    size = SIZE * quietest(fit)

    def shown(what: Added) -> Response:
        location, state, word, runs = what
        off = [{name: value[None] for name, value in run.items()} for run in runs]
        return Response(location, state, word, _single(added(fit, off))[0])

    yield [*mapper(shown, outputs(fit, runs))]
    held = courses(fit) if fit.problem.machine.drive == "dc" else []
    for kind in probes(fit, runs):
        alike = [list(some) for _, some in groupby(kind, _way)]
        blocks = [some[n : n + LANES] for some in alike for n in range(0, len(some), LANES)]
        found = mapper(lambda block: moved(fit, block, size, held), blocks)
        yield [response for block in found for response in block]


def _way(probe: Probe) -> tuple[bool, str]:
    """Probes for which this is the same act alike."""
    return probe.volts, probe.location
