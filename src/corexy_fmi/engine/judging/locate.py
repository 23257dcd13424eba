"""Locate: when, where on the path and in which band the retuned machine differs from the data."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from corexy_fmi.engine.data.samples import even
from corexy_fmi.engine.evidence import MissingForce, Spectrum
from corexy_fmi.engine.fitting.holding import holding_stiffness
from corexy_fmi.engine.judging.prove import Proof, Replay
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine
from corexy_fmi.topology import Stage

WINDOW = 0.1  # [s]
CELLS = 8  # of the path, along each axis
PATH_ENTRIES, TIME_ENTRIES = 5, 6


def _mismatch(retuned: Replay, explained: Replay, channel: int) -> Array:
    """What the explanation took away (m,); the whole mismatch where nothing explains it."""
    taken = retuned.errors[channel] - explained.errors[channel]
    return taken if np.any(taken) else retuned.errors[channel]


def _excess(retuned: Replay, explained: Replay) -> tuple[Array, Array]:
    """Time [s] and energy of the mismatch (squared, in noise units), channels pooled.

    They are those of place and acceleration; speeds and encoders count where there is no other.
    """
    times, energy = [], []
    channels = {s.channel for s in retuned.run.samples}
    counted = channels & {"x", "y", "ax", "ay"} or channels
    for c, samples in enumerate(retuned.run.samples):
        if samples.channel in counted:
            scale = max(float(np.std(explained.errors[c])), 1e-15)
            times.append(retuned.run.excitation.time[samples.index])
            energy.append((_mismatch(retuned, explained, c) / scale) ** 2)
    return np.concatenate(times), np.concatenate(energy)


def windows(proof: Proof) -> list[list[object]]:
    """[file, start, end, share of the mismatch] of the windows that hold most of it."""
    rows: list[tuple[str, float, float, float]] = []
    total = 0.0
    for retuned, explained in zip(
        proof.replays["retuned"], proof.replays["explained"], strict=True
    ):
        time, energy = _excess(retuned, explained)
        total += float(energy.sum())
        edges = np.arange(time.min(), time.max() + 2 * WINDOW, WINDOW)
        held, _ = np.histogram(time, edges, weights=energy)
        rows += [(retuned.run.name, a, b, e) for a, b, e in _merged(edges, held)]
    rows.sort(key=lambda row: -row[3])
    return [
        [n, float(a), float(b), float(e / max(total, 1e-300))] for n, a, b, e in rows[:TIME_ENTRIES]
    ]


def _merged(edges: Array, energy: Array) -> list[tuple[float, float, float]]:
    """Neighbouring windows above twice the mean energy, joined."""
    result, open_at = [], None
    strong = np.r_[energy > 2 * energy.mean(), False]
    for n, on in enumerate(strong):
        if on and open_at is None:
            open_at = n
        elif not on and open_at is not None:
            result.append((float(edges[open_at]), float(edges[n]), float(energy[open_at:n].sum())))
            open_at = None
    return result


def places(proof: Proof, stage: Stage, radius: float) -> list[list[float]]:
    """[x, y, share] of the cells of the commanded path that hold most of the mismatch [m]."""
    points, energies = [], []
    for retuned, explained in zip(
        proof.replays["retuned"], proof.replays["explained"], strict=True
    ):
        time, energy = _excess(retuned, explained)
        e = retuned.run.excitation
        if e.mode != "voltages":
            a, b = (np.interp(time, e.time, i) for i in (e.input1, e.input2))
            points.append(np.column_stack(stage.path(radius, a, b)))
            energies.append(energy)
    if not points:
        return []
    xy, energy = np.concatenate(points), np.concatenate(energies)
    held, edges_x, edges_y = np.histogram2d(xy[:, 0], xy[:, 1], bins=CELLS, weights=energy)
    order = np.argsort(held, axis=None)[::-1][:PATH_ENTRIES]
    total = max(float(held.sum()), 1e-300)
    middle = [(edges[1:] + edges[:-1]) / 2 for edges in (edges_x, edges_y)]
    picks = [np.unravel_index(k, held.shape) for k in order if held.flat[k] > 0]
    return [[float(middle[0][i]), float(middle[1][j]), float(held[i, j] / total)] for i, j in picks]


def _rate(replayed: Replay, channel: int) -> float:
    index = replayed.run.samples[channel].index
    return 1.0 / float(np.median(np.diff(replayed.run.excitation.time[index])))


def spectra(proof: Proof) -> tuple[Spectrum, ...]:
    """Amplitude densities of the mismatch of the longest training run, channel by channel."""
    train = [k for k, run in enumerate(proof.runs) if run.role == "train"]
    k = max(train, key=lambda n: proof.runs[n].count)
    retuned, explained = proof.replays["retuned"][k], proof.replays["explained"][k]
    result = []
    for c, samples in enumerate(retuned.run.samples):
        time = retuned.run.excitation.time[samples.index]
        (was, spacing), (now, _) = (even(r.errors[c], time) for r in (retuned, explained))
        rate, length = 1.0 / spacing, min(1024, len(was))
        f, before = welch(was, rate, nperseg=length)
        _, after = welch(now, rate, nperseg=length)
        flat = np.full(len(f), proof.noise_std[k][c] / np.sqrt(rate / 2))
        result.append(
            Spectrum(samples.channel, f[1:], np.sqrt(before[1:]), np.sqrt(after[1:]), flat[1:])
        )
    return tuple(result)


def band(proof: Proof) -> list[float]:
    """Band [Hz] that holds nine tenths of the mismatch."""
    train = [k for k, run in enumerate(proof.runs) if run.role == "train"]
    k = max(train, key=lambda n: proof.runs[n].count)
    retuned, explained = proof.replays["retuned"][k], proof.replays["explained"][k]
    c = max(
        range(len(retuned.errors)),
        key=lambda n: float(np.std(_mismatch(retuned, explained, n))) / proof.noise_std[k][n],
    )
    time = retuned.run.excitation.time[retuned.run.samples[c].index]
    taken, spacing = even(_mismatch(retuned, explained, c), time)
    f, power = welch(taken, 1.0 / spacing, nperseg=min(2048, len(taken)))
    reached = np.cumsum(power) / max(float(power.sum()), 1e-300)
    return [float(f[min(np.searchsorted(reached, q), len(f) - 1)]) for q in (0.05, 0.95)]


def missing_forces(proof: Proof, machine: Machine) -> tuple[MissingForce, ...]:
    """Force [N] that would hold the retuned mismatch of x and y, quasi-statically (eq. 15).

    K e with K = 2 k_e, smoothed over 20 ms; the band is that of the noise alone.
    """
    stiffness, result = holding_stiffness(machine), []
    for k, replayed in enumerate(proof.replays["retuned"]):
        for c, samples in enumerate(replayed.run.samples):
            if samples.channel in ("x", "y"):
                width = max(int(0.02 * _rate(replayed, c)), 1)
                smooth = np.convolve(replayed.errors[c], np.full(width, 1 / width), mode="same")
                quiet = 1.96 * proof.noise_std[k][c] / np.sqrt(width)
                time = replayed.run.excitation.time[samples.index]
                result.append(
                    MissingForce(
                        samples.channel,
                        replayed.run.name,
                        time,
                        stiffness * smooth,
                        stiffness * quiet,
                        "N",
                    )
                )
    return tuple(result)
