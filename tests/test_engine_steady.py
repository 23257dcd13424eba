"""Whether a wave keeps its size and phase: a fan does, what dies away or drifts does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.judging.steady import unsteady
from corexy_fmi.engine.naming.specification import NOTHING
from corexy_fmi.machine import EffectUse
from corexy_fmi.recording import Recording

FAN = ("periodic_disturbance", "x")
TONE = 7.0  # [Hz]


def blown(seed: int, frequency: float = TONE, force: float = 0.8) -> Recording:
    """A fan on x."""
    use = EffectUse(*FAN, {"amplitude": force, "frequency": frequency, "phase": 0.4})
    return record(replace(machine(), effects=(use,)), rich_motion(), f"run{seed}.csv", seed=seed)


def joined(first: Recording, then: Recording) -> Recording:
    """One up to the middle, the other from there on."""
    early = np.arange(len(first)) < len(first) // 2
    both = {c: np.where(early, first[c], then[c]) for c in first.channels}
    return replace(first, channels=both)


def heard(recording: Recording) -> Fit:
    """One fan fitted to it."""
    asked = problem(recording, machine(), [FAN])
    start = np.zeros(asked.size)
    known = {"amplitude": 0.8, "frequency": TONE, "phase": 0.4}
    for k, unknown in enumerate(asked.unknowns):
        name = unknown.key.rpartition(".")[2].partition("@")[0]
        if unknown.key.startswith(".".join(FAN)) and name in known:
            start[k] = unknown.internal(known[name])
    return minimise(asked, start, 15)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_fan_is_steady(seed: int) -> None:
    found = unsteady(heard(blown(seed, TONE)))
    assert abs(found.score) < 4.0
    assert not found.matters(0.0)


def test_one_that_dies_away_is_none() -> None:
    found = unsteady(heard(joined(blown(1), blown(1, force=0.1))))
    assert found.matters(0.0)
    assert found.cause.startswith(".".join(FAN))


def test_one_that_drifts_is_none() -> None:
    """Its frequency is another one in the second half."""
    assert unsteady(heard(joined(blown(1), blown(1, frequency=1.1 * TONE)))).matters(0.0)


def test_nothing_else_is_asked() -> None:
    recording = record(machine(), rich_motion(), seed=1)
    assert unsteady(fitted(problem(recording, machine(), [("constant_force", "x")]))) is NOTHING
