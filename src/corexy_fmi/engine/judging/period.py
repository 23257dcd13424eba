"""Whether a mismatch repeats with a motor's angle, and which length of the machine that is."""

from __future__ import annotations

import numpy as np

from corexy_fmi.effects.api import ROTOR_TEETH, TWO_PI
from corexy_fmi.engine.judging.prove import Proof, Replay
from corexy_fmi.kernel.call import Array

SHARE = 0.3  # of the mismatch's power that one wave must hold to be told
MOST, CELLS, FINER = 210.0, 1024, 4  # waves a turn; of a turn's spectrum; zero padding
LEAST = 4.0  # waves that the range holds
KNOWN = {1: "a turn of the motor", ROTOR_TEETH: "an electrical cycle of a stepper",
         4 * ROTOR_TEETH: "a full step of a stepper"}  # fmt: skip
TEETH = range(10, 41)  # of a motor's pulley


def period(proof: Proof) -> str:
    """The strongest wave of the retuned mismatch over a motor's angle, in words; else nothing."""
    found = [
        wave
        for run, replayed in zip(proof.runs, proof.replays["retuned"], strict=True)
        if run.role == "train" and run.excitation.mode != "voltages"
        for wave in _waves(replayed)
    ]
    share, waves, motor, spacing = max(found, default=(0.0, 0.0, 0, 0.0))
    if share < SHARE:
        return ""
    radians = f"{TWO_PI / waves:.3g} rad of motor {motor}"
    return f"it repeats every {radians}, {_length(waves, spacing)} ({100 * share:.0f} % of it)"


def _waves(replayed: Replay) -> list[tuple[float, float, int, float]]:
    """(share of the power, waves a turn, motor, resolution) of each channel's strongest wave."""
    excitation, found = replayed.run.excitation, []
    for motor, angle in enumerate((excitation.input1, excitation.input2), 1):
        for error, samples in zip(replayed.errors, replayed.run.samples, strict=True):
            found += _strongest(angle[samples.index], error, motor)
    return found


def _strongest(angle: Array, error: Array, motor: int) -> list[tuple[float, float, int, float]]:
    turned, e = (angle - angle.min()) / TWO_PI, error - error.mean()
    turns = float(turned.max())
    summed = np.bincount((turned * CELLS).astype(int), e)
    size = FINER * len(summed)
    waves = np.arange(size // 2 + 1) * CELLS / size
    held = (waves >= LEAST / max(turns, 1e-9)) & (waves <= MOST)
    if not held.any():
        return []
    best = float(waves[held][np.argmax(np.abs(np.fft.rfft(summed, size))[held])])
    return [(_share(TWO_PI * best * turned, e), best, motor, 1 / turns)]


def _share(phase: Array, error: Array) -> float:
    """Share of an error's power that a wave of these phases holds."""
    wave = np.column_stack([np.sin(phase), np.cos(phase)])
    left = error - wave @ np.linalg.lstsq(wave, error, rcond=None)[0]
    return 1 - float(left @ left) / max(float(error @ error), 1e-300)


def _length(waves: float, spacing: float) -> str:
    """Which of the machine's lengths fits a count of waves a turn, as finely as it is known."""
    for count, name in KNOWN.items():
        if abs(waves - count) < spacing / 2:
            return name
    near = round(waves)
    if near in TEETH and abs(waves - near) < spacing / 2:
        return f"a tooth of a pulley of {near}"
    return "no known length of the machine"
