"""Channels computed from another one are left out; those of a sensor of their own stay."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, record, rich_motion
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter, savgol_filter

from corexy_fmi.engine.data.derived import without_derived
from corexy_fmi.engine.data.given import preflight

NOISE = 2e-5


def gradient(values, time):
    return np.gradient(values, time)


def backward(values, time):
    return np.r_[0.0, np.diff(values) / np.diff(time)]


def smoothed(values, time):
    return savgol_filter(values, 31, 3, deriv=1, delta=time[1] - time[0])


def low_pass(values, time):
    return lfilter([0.2], [1, -0.8], gradient(values, time))


def slow_gaussian(values, time):
    return gaussian_filter1d(values, 4, order=1) / (time[1] - time[0])


def rounded(values, time):
    return np.round(gradient(values, time), 5)


WAYS = (gradient, backward, smoothed, low_pass, slow_gaussian, rounded)


@pytest.fixture(scope="module")
def sensed():
    """Every channel from a sensor of its own, with its own noise."""
    return record(
        machine(), rich_motion(), noise=NOISE, channels=("x", "y", "vx", "vy", "ax", "ay")
    )


def coloured(recording, rho=0.8):
    extra = np.random.default_rng(2).normal(size=(2, len(recording))) * NOISE
    slow = lfilter([1.0], [1.0, -rho], extra)
    return with_channels(recording, x=recording["x"] + slow[0], y=recording["y"] + slow[1])


def with_channels(recording, **channels):
    return replace(recording, channels={**recording.channels, **channels})


def left_out(recording):
    kept, findings = without_derived(recording)
    gone = recording.channels.keys() - kept.channels.keys()
    assert len(findings) == len(gone)
    assert all(any(f"channel {name} was computed" in f.text for f in findings) for name in gone)
    return gone


@pytest.mark.parametrize("colour", [lambda r: r, coloured])
@pytest.mark.parametrize("way", WAYS)
def test_what_was_computed_from_positions_is_left_out(sensed, way, colour):
    given = colour(sensed)
    computed = {f"v{n}": way(given[n], given.time) for n in "xy"}
    assert left_out(with_channels(given, **computed)) == {"vx", "vy"}


@pytest.mark.parametrize("way", WAYS)
def test_accelerations_computed_from_a_speed_are_left_out(sensed, way):
    speed = sensed["vx"] + np.random.default_rng(3).normal(size=len(sensed)) * 1e-3
    given = with_channels(sensed, vx=speed, ax=way(speed, sensed.time))
    assert left_out(given) == {"ax"}


@pytest.mark.parametrize("noise", [0.0, 1e-7, 2e-5, 1e-3])
@pytest.mark.parametrize("name", ["yin2018", "gt2_printer"])
def test_sensors_of_their_own_stay(name, noise):
    own = record(machine(name), rich_motion(), noise=noise, channels=("x", "y", "vx", "ax"))
    assert left_out(own) == set()
    assert without_derived(own)[0] is own


@pytest.mark.parametrize("noise", [1e-9, 1e-5, 1e-3])
@pytest.mark.parametrize("own", [0.0, 1e-7, 1e-2])
def test_quiet_sensors_beside_loud_ones_stay(noise, own):
    """Positions with a noise [m] beside speeds with one of their own [m/s]."""
    clean = record(machine(), rich_motion(), noise=0.0, channels=("x", "y", "vx", "vy"))
    random = np.random.default_rng(5)
    loud = {n: clean[n] + noise * random.normal(size=len(clean)) for n in ("x", "y")}
    quiet = {n: clean[n] + own * random.normal(size=len(clean)) for n in ("vx", "vy")}
    assert left_out(with_channels(clean, **loud, **quiet)) == set()


def test_one_that_was_computed_from_another_recording_stays(sensed):
    other = coloured(sensed)
    given = with_channels(sensed, vx=gradient(other["x"], other.time))
    assert left_out(given) == set()


def test_rows_without_a_sample_do_not_hide_it(sensed):
    given = with_channels(sensed, vx=gradient(sensed["x"], sensed.time))
    gaps = np.random.default_rng(0).random(len(given)) < 0.01
    blank = {n: np.where(gaps, np.nan, given[n]) for n in ("x", "vx")}
    assert left_out(with_channels(given, **blank)) == {"vx"}


def test_preflight_tells_it(sensed):
    given = with_channels(sensed, vy=gradient(sensed["y"], sensed.time))
    (kept,), findings = preflight([given], machine())
    assert "vy" not in kept.channels
    assert [f.text for f in findings] == [
        f"{given.name}: channel vy was computed from y, noise and all"
    ]
