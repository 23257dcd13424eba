"""Stamps that scatter about an even clock are told from rows that were taken unevenly."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import ASIDE, BACKLASH, NOISE, machine, other_motion, rich_motion, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording, with_even_stamps
from corexy_fmi.simulate import simulate

PERIOD = 1e-3  # [s]


def taken(truth, motion, name, seed, off=0.0):
    """A recording whose rows are taken ``off`` [s] beside an even clock, rms, with true stamps."""
    random = np.random.default_rng(seed)
    order = command(motion, truth.parameters["pulley_radius"], name=name)
    time = np.arange(0.0, order.time[-1], PERIOD)
    time[1:-1] += np.clip(off * random.normal(size=len(time) - 2), -0.4 * PERIOD, 0.4 * PERIOD)
    angles = {n: np.interp(time, order.time, order[n]) for n in ("phi1", "phi2")}
    given = Recording(name, time, angles)
    response = simulate(truth, given)
    noisy = {n: response[n] + NOISE * random.normal(size=len(time)) for n in ("x", "y")}
    return replace(given, channels={**angles, **noisy})


def scattered(recording, seed, off=6e-5):
    """The same with stamps that scatter."""
    late = off * np.random.default_rng(seed).uniform(-np.sqrt(3), np.sqrt(3), len(recording))
    return replace(recording, time=recording.time + late)


@pytest.fixture(scope="module")
def even():
    return taken(machine(), rich_motion(), "train.csv", 1)


@pytest.mark.parametrize("share", [0.0, 0.03])
def test_the_even_clock_is_found_again(even, share):
    """Within a tenth of the scatter, rows missing or not; the clock's own zero aside."""
    kept = np.random.default_rng(2).random(len(even)) >= share
    kept[[0, -1]] = True
    rows = {n: v[kept] for n, v in even.channels.items()}
    fewer = replace(even, time=even.time[kept], channels=rows)
    found, scatter = with_even_stamps(scattered(fewer, 3))
    assert scatter == pytest.approx(6e-5, rel=0.05)
    assert np.std(found.time - fewer.time) < 6e-6
    assert np.diff(found.time).min() > 0.9 * PERIOD


def test_stamps_that_scatter_by_almost_half_a_period_are_put_back(even):
    """Neighbours come within a fifth of a period there, or as far as where a row lacks."""
    late = 4e-4 * np.random.default_rng(6).uniform(-1, 1, len(even))
    found, scatter = with_even_stamps(replace(even, time=np.sort(even.time + late)))
    assert scatter == pytest.approx(4e-4 / np.sqrt(3), rel=0.05)
    assert np.std(found.time - even.time) < 2e-5


def test_what_is_even_or_truly_uneven_stays_as_it_is(even):
    """The same scatter, in when the rows were taken."""
    uneven = taken(machine(), rich_motion(), "uneven.csv", 4, off=6e-5)
    still = {n: np.full(len(even), 0.3) for n in ("phi1", "phi2")}
    rest = scattered(replace(even, channels={**even.channels, **still}), 5)
    short = replace(
        even, time=even.time[:20], channels={n: v[:20] for n, v in even.channels.items()}
    )
    for recording in (even, uneven, rest, short):
        found, scatter = with_even_stamps(recording)
        assert found is recording
        assert scatter == 0.0


@pytest.mark.parametrize("uses", [(), (BACKLASH,)], ids=["nothing", "backlash"])
def test_scattered_stamps_are_told_and_hide_nothing(uses):
    """Before, what was left of x followed the acceleration: `unexplained`."""
    truth = with_effects(machine(), *uses, **ASIDE)
    files = (
        taken(truth, rich_motion(), "train.csv", 1),
        taken(truth, other_motion(), "judge.csv", 2),
    )
    train, judge = (scattered(recording, 7 + n) for n, recording in enumerate(files))
    document = diagnose([train], [judge], machine(), jobs=2).document
    assert document["verdict"] == ("explained" if uses else "nothing_missing")
    assert [e["name"] for e in document["effects"]] == [u.name for u in uses]
    assert "stamps scatter by 0.06 ms" in document["findings"][0]["text"]
