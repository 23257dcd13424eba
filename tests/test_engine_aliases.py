"""Tones that a slow tracker's samples cannot tell apart are tried at each of their frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, other_motion, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.naming.aliases import aliases
from corexy_fmi.engine.naming.overtones import overtone_fits
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

NOISE, RATE = 5e-6, 100.0  # [m], [Hz]
SEEN = 17.05  # [Hz], what the tracker shows of 82.95


@pytest.mark.parametrize("frequency", [0.4, 17.05, 49.0, 62.0, 117.05])
def test_samples_of_an_alias_are_samples_of_the_tone(frequency):
    seen = problem(record(machine(), other_motion(), tracker=10), machine())
    time = np.arange(300) / RATE
    tones = np.exp(2j * np.pi * frequency * time)
    found = aliases(seen, frequency)
    assert len(found) == 4
    for other in found:
        tone = np.exp(2j * np.pi * other * time)
        assert np.allclose(tone, tones) or np.allclose(tone, tones.conj())


def test_channels_at_several_rates_tell_tones_apart():
    shown = record(machine(), other_motion())
    slow = np.where(np.arange(len(shown)) % 10 == 0, shown["x"], np.nan)
    mixed = replace(shown, channels={**shown.channels, "x": slow})
    assert aliases(problem(mixed, machine()), SEEN) == ()


@pytest.mark.parametrize(
    ("truth", "shaped"),
    [
        ({"amplitude": 2.0, "frequency": 82.95}, False),
        ({"amplitude": 6.0, "frequency": 27.65, "duty": 0.15}, True),
    ],
    ids=["sine", "pulses"],
)
def test_what_is_faster_than_a_tracker_is_found_from_its_alias(truth, shaped):
    bare, runs = machine(), []
    for n, (motion, phase) in enumerate([(rich_motion(), 0.4), (other_motion(), -2.0)]):
        wave = EffectUse("periodic_disturbance", "x", truth | {"phase": phase})
        shown = record(
            with_effects(bare, wave), motion, f"{n}.csv", seed=n, noise=NOISE, tracker=10
        )
        runs += problem(shown, bare, std=NOISE).runs
    base = retune(bundled_layout(), bare, tuple(runs))
    chosen = problem(shown, bare, [("periodic_disturbance", "x")])
    chosen = replace(base.problem, hypothesis=chosen.hypothesis)
    start = chosen.carried(base.problem, base.u)
    first = {"frequency": SEEN, "amplitude": 1.0}
    for k, unknown in enumerate(chosen.unknowns):
        name = unknown.key.rpartition(".")[2]
        if name in first:
            start[k] = unknown.internal(first[name])
    sine = minimise(chosen, start, 20)
    found = min(overtone_fits(base, [sine], map), key=lambda fit: fit.cost)
    assert found.problem.hypothesis.shaped == shaped
    assert found.cost < sine.cost - 20
    for name, value in truth.items():
        assert found.value(f"periodic_disturbance.x.{name}") == pytest.approx(value, rel=0.1)
    frequency = found.value("periodic_disturbance.x.frequency")
    assert frequency == pytest.approx(truth["frequency"], abs=0.03)
