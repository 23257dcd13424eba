"""Responses: how the whitened residuals of a fit change by each probe (rows,), retuning taken off.

Probes of motors, axes and belts are replayed with those commands; what a sensor, a tool, a frame
or a bridge that turns would show is added to the simulated outputs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from corexy_fmi.engine.fit import Fit, Mapper
from corexy_fmi.engine.noise import quick_noise
from corexy_fmi.engine.probe_laws import Motion
from corexy_fmi.engine.probes import Probe, probes
from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.topology import STAGES

SIZE = 2.0  # of a probe, in the noise of the quieter of x and y
USUAL, VOLTS = 1e-5, 0.02  # [m] of that noise where neither is measured; [V] of a probe
MODES = tuple(np.geomspace(3.0, 100.0, 12))  # [Hz] of what swings on the stage, or under it
DAMPED = 0.05  # its damping ratio


@dataclass(frozen=True, eq=False)
class Response:
    """A place, the state and word of one probe there, and what it changes (samples + size,)."""

    location: str
    state: str
    word: str
    change: Array


def moved(fit: Fit, probe: Probe, q: Array, size: float) -> Response:
    """The response to a probe: a replay with such commands, or voltages; where those do not hold a
    motor, where the end-effector would rest.
    """
    radius = fit.problem.machine.parameters["pulley_radius"]
    most = max(float(np.abs(v).max()) for pair in probe.turns for v in pair) or 1.0
    if fit.problem.machine.drive == "dc" and not probe.volts:
        rest = [{"x": radius * (a + b) / 2, "y": radius * (a - b) / 2} for a, b in probe.turns]
        change = added(fit, rest)
    else:
        scale = (VOLTS if probe.volts else size / radius) / most
        change = _replayed(fit, probe, scale) / scale
    return Response(probe.location, probe.state, probe.word, _off(change, q))


def _off(change: Array, q: Array) -> Array:
    """What is left of a change beside q; in single precision, for its room."""
    return np.asarray(change - q @ (q.T @ change), dtype=np.float32)


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


def shown(fit: Fit, runs: list[Motion], q: Array) -> Iterator[Response]:
    """The responses to what is added to the outputs x and y."""
    outputs = [*_sensor(runs), *_swinging(fit, runs), *_turning(fit, runs)]
    for location, state, word, off in outputs:
        yield Response(location, state, word, _off(added(fit, off), q))


Added = tuple[str, str, str, list[dict[str, Array]]]  # location, state, word, by channel


def _sensor(runs: list[Motion]) -> Iterator[Added]:
    """What a sensor may misread, each of its axes for itself, or both late alike."""
    for axis in ("x", "y"):
        for word in ("x", "y", "xx", "xy", "yy"):
            yield (
                "sensor",
                "position",
                f"{axis} by {word}",
                [{axis: np.prod([m.place[w] for w in word], axis=0)} for m in runs],
            )
        yield "sensor", "speed", f"{axis} late", [{axis: m.speed[axis]} for m in runs]
        yield (
            "sensor",
            "time",
            f"{axis} ever later",
            [{axis: (m.time - m.time[0]) * m.speed[axis]} for m in runs],
        )
    yield "sensor", "speed", "both late", [{a: m.speed[a] for a in "xy"} for m in runs]
    yield (
        "sensor",
        "time",
        "both ever later",
        [{a: (m.time - m.time[0]) * m.speed[a] for a in "xy"} for m in runs],
    )


def swing(values: Array, time: Array, frequency: float) -> Array:
    """Where a mass on a damped spring comes to under these accelerations (rows,)."""
    dt, w = float(np.median(np.diff(time))), 2 * np.pi * frequency
    decay, turn = np.exp(-DAMPED * w * dt), np.cos(w * np.sqrt(1 - DAMPED**2) * dt)
    poles = [1.0, -2 * decay * turn, decay**2]
    return np.asarray(lfilter([0.0, sum(poles) / w**2], poles, values))


def _swinging(fit: Fit, runs: list[Motion]) -> Iterator[Added]:
    """A tool that lags behind the accelerations of both axes, or a frame that their forces move."""
    values = fit.problem.machine.parameters
    carriage = values["carriage_mass"]
    masses = {"x": carriage, "y": carriage + values["bridge_mass"] + 4 * values["pulley_mass"]}
    accelerations = [{a: np.gradient(m.speed[a], m.time) for a in "xy"} for m in runs]
    times = [m.time for m in runs]
    for location, weights in (("tool", dict.fromkeys("xy", 1.0)), ("frame", masses)):
        for f in MODES:
            bent = [
                {axis: weights[axis] * swing(values, t, f) for axis, values in pair.items()}
                for pair, t in zip(accelerations, times, strict=True)
            ]
            late = [
                {axis: np.gradient(values, t) for axis, values in pair.items()}
                for pair, t in zip(bent, times, strict=True)
            ]
            yield location, "acceleration", f"a mode near {f:.0f} Hz", bent
            yield location, "acceleration", f"a mode near {f:.0f} Hz, damped", late


def _turning(fit: Fit, runs: list[Motion]) -> Iterator[Added]:
    """A bridge that the belts turn: y by x times the turn."""
    stage = STAGES[fit.problem.machine.stage]
    arms = np.array([s.yaw_arm for s in stage.sections], dtype=float)
    names = tuple(f"tension{n + 1}" for n in np.flatnonzero(arms))
    if not names:
        return
    pulls = [
        arms[arms != 0] @ fit.problem.simulate(fit.u[None], r, names)[0] for r in range(len(runs))
    ]
    for f in (*MODES, 1e3):
        word = "its turn" if f == MODES[-1] else f"a mode near {f:.0f} Hz"
        yield (
            "bridge",
            "position",
            word,
            [
                {
                    "y": m.place["x"]
                    * swing(p, m.time, min(f, 0.1 / float(np.median(np.diff(m.time)))))
                }
                for m, p in zip(runs, pulls, strict=True)
            ],
        )


def responses(fit: Fit, runs: list[Motion], q: Array, mapper: Mapper) -> Iterator[list[Response]]:
    """Responses to all probes, what retuning can do (its orthonormal ``q``) taken off, a kind of
    place at a time: they take some room.
    """
    size = SIZE * quietest(fit)
    yield [*shown(fit, runs, q)]
    for kind in probes(fit, runs):
        yield [*mapper(lambda probe: moved(fit, probe, q, size), kind)]
