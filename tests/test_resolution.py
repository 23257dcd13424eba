"""What a coarse sensor rounds is nothing that can be told, and hides nothing that is larger."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import ASIDE, EffectUse, fitted, machine, named, pair, problem, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.steps import sensor_step
from corexy_fmi.engine.fitting.resolution import _is_rounding, at_resolution

STEP = 1e-5  # [m]
MISMATCH = EffectUse("belt_mismatch", "belts", {"ratio": 0.03})


def coarse(recording, step=STEP):
    """A recording in whole steps."""
    rounded = {n: np.round(recording.channels[n] / step) * step for n in ("x", "y")}
    return replace(recording, channels={**recording.channels, **rounded})


def files(*uses, noise=0.0):
    """Training and held-out recordings in whole steps."""
    parts = pair(with_effects(machine(), *uses, **ASIDE), noise=noise)
    return [[coarse(recording) for recording in part] for part in parts]


@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_rounding_alone_is_nothing(noise):
    """All rows of a stroke at 100 mm/s round alike."""
    found = diagnose(*files(noise=noise), machine(), jobs=2).document
    assert found["verdict"] == "nothing_missing"
    (told,) = found["findings"]
    assert "x in steps of 1e-05, y in steps of 1e-05" in told["text"]


def test_what_is_larger_is_named_with_nothing_beside_it():
    """Twenty micrometres of a mismatch behind steps of ten."""
    found = diagnose(*files(MISMATCH), machine(), jobs=2).document
    assert found["verdict"] == "explained"
    assert named(found) == {("belt_mismatch", "belts")}


@pytest.mark.parametrize(("noise", "fine"), [(0.0, True), (3e-6, False)])
def test_noise_beside_the_steps_can_be_told_from_them(noise, fine):
    """The variance of the steps is a twelfth of their square; the noise adds its own."""
    (train,), _ = files(noise=noise)
    fit = fitted(problem(train, machine(), std=STEP / np.sqrt(12)))
    assert at_resolution(fit) is fine


def test_an_axis_that_stands_still_errs_alike_for_long():
    """Half of the time 0.4 of a step either way: more than on the move, none beyond half."""
    (train,), _ = files()
    samples = problem(train, machine()).runs[0].samples[0]
    count = len(samples.index)
    stands = np.where(np.arange(count) % 2 > 0, 0.4, -0.4)
    errors = STEP * stands
    errors[: count // 2] = STEP * np.linspace(-0.5, 0.5, count // 2)
    assert np.std(errors) > 1.15 * STEP / np.sqrt(12)
    assert _is_rounding(samples, errors)
    errors[count // 3] = STEP
    assert not _is_rounding(samples, errors)


def test_a_channel_without_steps_has_none():
    (train,), _ = pair(machine(), noise=1e-5)
    (samples, _) = problem(train, machine()).runs[0].samples
    assert sensor_step(samples.value) == 0.0
    (samples, _) = problem(coarse(train), machine()).runs[0].samples
    assert sensor_step(samples.value) == pytest.approx(STEP)
