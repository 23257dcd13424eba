"""How a measured pair of channels follows the motion that the machine file predicts.

measured = M simulated + offset, by least squares.  M is near the identity on a sound rig, whatever
lag the machine has: the lag is in the simulation.  Accelerations are compared by their integrals,
which a wrong natural frequency hardly touches.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import excitation, simulate
from corexy_fmi.topology import STAGES

TRAVEL = 1e-4  # [m] rms motion below which nothing is judged
SURE = 0.15  # standard error of an entry of M up to which a second direction counts
INDEPENDENT = 50  # samples that are worth one, errors being coloured
NEAR = 0.35  # distance up to which a map counts as an exchange of axes
FEW = 20  # samples below which a channel is not judged
IDENTITY = np.eye(2)
SIGNED = {
    "": IDENTITY,
    "x mirrored": np.array([[-1.0, 0], [0, 1]]),
    "y mirrored": np.array([[1.0, 0], [0, -1]]),
    "both axes mirrored": -IDENTITY,
    "x and y swapped": np.array([[0.0, 1], [1, 0]]),
    "x and y swapped, both mirrored": np.array([[0.0, -1], [-1, 0]]),
    "axes turned by +90 deg": np.array([[0.0, -1], [1, 0]]),
    "axes turned by -90 deg": np.array([[0.0, 1], [-1, 0]]),
}


@dataclass(frozen=True, eq=False)
class Map:
    """M of one pair: ``rows`` (2, 2), NaN rows where a channel is absent; ``directions`` (2, k)
    are those in which the stage was driven, as orthonormal columns; ``follows`` (2,) is the share
    of each channel's variance that M explains.
    """

    rows: Array
    directions: Array
    follows: Array

    @property
    def response(self) -> Array:
        """M in the driven directions, (2, k)."""
        return self.rows @ self.directions

    @property
    def sizes(self) -> Array:
        """Size of each channel's response, (2,); one driven direction gives both the same."""
        if self.directions.shape[1] == 2:
            return np.asarray(np.linalg.norm(self.response, axis=1))
        return np.full(2, np.sqrt(np.nansum(self.response**2)))

    def scaled(self, factors: Array) -> Map:
        """The map after each channel is divided by its factor (2,)."""
        return replace(self, rows=self.rows / factors[:, None])

    def distance(self, target: Array) -> float:
        """Root mean square distance of the responses to those of a target map (2, 2)."""
        return float(np.sqrt(np.nanmean((self.response - target @ self.directions) ** 2)))


def predicted(recording: Recording, machine: Machine) -> Recording | None:
    """The machine's own response; by eq. (1) from encoders where voltages drive an open loop."""
    drive = excitation(machine, recording)
    if drive.mode == "voltages":
        return _by_encoders(recording, machine)
    response = simulate(machine, recording)
    sound = all(np.isfinite(response[n]).all() for n in ("x", "y", "vx", "vy"))
    return response if sound else _by_angles(recording, machine, drive.input1, drive.input2)


def _by_encoders(recording: Recording, machine: Machine) -> Recording | None:
    names = ("phi1_meas", "phi2_meas")
    if not set(names) <= set(recording.measured):
        return None
    seen = [np.isfinite(recording[n]) for n in names]
    filled = [
        np.interp(recording.time, recording.time[s], recording[n][s])
        for n, s in zip(names, seen, strict=True)
    ]
    return _by_angles(recording, machine, *filled)


def _by_angles(recording: Recording, machine: Machine, a: Array, b: Array) -> Recording:
    x, y = STAGES[machine.stage].path(machine.parameters["pulley_radius"], a, b)
    channels = {"x": x, "y": y, "phi1_meas": a, "phi2_meas": b}
    channels |= {f"v{n}": np.gradient(channels[n], recording.time) for n in ("x", "y")}
    return Recording(recording.name, recording.time, channels)


def fitted(recording: Recording, response: Recording, pair: tuple[str, str]) -> Map | None:
    """M of a pair of channels; None where the stage hardly moved or no channel took samples."""
    integrated = pair[0] == "ax"
    names = ("vx", "vy") if integrated else pair
    known = np.column_stack([response[n] for n in names])
    rows, follows, spreads = np.full((2, 2), np.nan), np.full(2, np.nan), np.full(2, 0.0)
    for k, channel in enumerate(pair):
        if channel in recording and np.isfinite(recording[channel]).sum() > FEW:
            rows[k], follows[k], spreads[k] = _row(recording, channel, known, integrated)
    if np.isnan(rows).all() or not driven(response):
        return None
    return Map(rows, _directions(known, spreads), follows)


def driven(response: Recording) -> bool:
    """Whether the stage moves enough for anything to be judged."""
    return max(float(np.std(response[n])) for n in ("x", "y")) > TRAVEL


def _row(
    recording: Recording, channel: str, known: Array, integrated: bool
) -> tuple[Array, float, float]:
    """One row of M (2,), the share of variance explained, and the error's spread in M's unit."""
    seen = np.isfinite(recording[channel])
    time, values = recording.time[seen], recording[channel][seen]
    nuisance = [np.ones(len(time))]
    if integrated:
        values = np.r_[0.0, np.cumsum(np.diff(time) * (values[1:] + values[:-1]) / 2)]
        nuisance.append(time - time.mean())
    basis = np.column_stack(nuisance)
    free = lambda v: v - basis @ np.linalg.lstsq(basis, v, rcond=None)[0]  # noqa: E731
    target, regressors = free(values), free(known[seen])
    row = np.linalg.lstsq(regressors, target, rcond=1e-3)[0]
    error, power = target - regressors @ row, float(target @ target)
    share = 1 - float(error @ error) / power if power > 0 else 0.0
    size = max(float(np.linalg.norm(row)), 1e-300)
    return row, share, float(np.sqrt(INDEPENDENT * np.mean(error**2) / len(time))) / size


def _directions(known: Array, spreads: Array) -> Array:
    """The driven directions (2, k): both, where the weaker one is told apart from errors."""
    _, sizes, axes = np.linalg.svd(known - known.mean(axis=0), full_matrices=False)
    rms = sizes / np.sqrt(len(known))
    both = rms[1] > 1e-3 * rms[0] and spreads.max() < SURE * rms[1]
    return np.asarray(axes[: 1 + both].T)


def orientation(found: Map) -> tuple[str, Array]:
    """Which signed exchange of axes a map in right units is; "" for none, the first of equals."""
    near = {name: round(found.distance(target), 9) for name, target in SIGNED.items()}
    best = min(near, key=lambda name: near[name])
    clear = near[best] < min(NEAR, 0.6 * near[""])
    return (best, SIGNED[best]) if clear else ("", IDENTITY)
