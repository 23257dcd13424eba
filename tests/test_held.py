"""A value that is written again is no sample; a stage that stands still is no fault."""

import numpy as np
import pytest
from engine_kit import BACKLASH, machine, named, pair, record, rich_motion, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.given import preflight
from corexy_fmi.engine.data.held import repeats

ROWS = np.arange(2000)
COURSE = 0.03 * np.sin(2 * np.pi * ROWS / 700)  # [m]
NOISE = 2e-5 * np.random.default_rng(1).normal(size=len(ROWS))  # [m]


def frozen(values, *places, rows=20):
    """The channel with one value held over so many rows behind each place."""
    result = values.copy()
    for k in places:
        result[k : k + rows + 1] = result[k]
    return result


def test_what_a_frozen_sensor_repeats_is_found():
    places = (150, 700, 1040, 1400)
    found = repeats(frozen(COURSE + NOISE, *places), COURSE)
    expected = np.zeros(len(ROWS), dtype=bool)
    for k in places:
        expected[k + 1 : k + 21] = True
    assert (found == expected).all()


@pytest.mark.parametrize("every", [2, 12])
def test_of_a_slow_sensor_new_values_stay(every):
    found = repeats((COURSE + NOISE)[ROWS // every * every], COURSE)
    assert (found == (ROWS % every != 0)).all()


@pytest.mark.parametrize("step", [1e-5, 2e-4])
def test_a_coarse_sensor_repeats_by_itself(step):
    assert not repeats(np.round((COURSE + NOISE) / step) * step, COURSE).any()


def test_a_stage_that_sticks_is_not_a_sensor_that_holds():
    """Play: it stands after each turn while its command goes on, and follows without a jump."""
    still = np.maximum.accumulate(np.where(ROWS < 350, COURSE, -1))
    follows = COURSE.copy()
    for k in range(1, len(ROWS)):
        low, high = COURSE[k] - 5e-4, COURSE[k] + 5e-4
        follows[k] = min(max(follows[k - 1], low), high)
    assert (np.diff(follows) == 0).sum() > 100
    for values in (still, follows):
        assert not repeats(values, COURSE).any()


def test_what_never_changes_or_is_blank_is_left_alone():
    assert not repeats(np.full(len(ROWS), 0.2), COURSE).any()
    assert not repeats(np.full(len(ROWS), np.nan), COURSE).any()


def test_simulated_recordings_without_noise_are_left_alone():
    """Play at rest and at turns repeats values, too."""
    recording = record(with_effects(machine(), BACKLASH), rich_motion(), noise=0.0)
    [whole], found = preflight([recording], machine())
    assert not found
    assert all(np.isfinite(whole[n]).all() for n in ("x", "y"))


def test_holds_are_told_and_hide_no_cause():
    files = [
        [r.__class__(r.name, r.time, {**r.channels, **{n: frozen(r[n], *range(90, len(r) - 60, 400),
                     rows=40) for n in ("x", "y")}})]
        for [r] in pair(with_effects(machine(), BACKLASH))
    ]  # fmt: skip
    document = diagnose(*files, machine(), jobs=2).document
    assert named(document) == {("backlash", "motor1")}
    assert "only repeat the one before" in document["findings"][0]["text"]
