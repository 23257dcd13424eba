"""Rows that a logger lost are put back, and a replay goes on as if none had been."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.machine import load_machine
from corexy_fmi.recording import Recording, with_lost_rows
from corexy_fmi.simulate import simulate

TIME = np.arange(2000) * 1e-3
LOOP = {"controller": "pd kp=20 kd=0.1"}


def order(corner=0.501):
    """A corner in phi1 beside a chirp in phi2, and one measured channel."""
    bent = np.interp(TIME, [0.0, 0.1, corner, 2.0], [0.0, 0.0, 8.0, 8.0])
    channels = {"phi1": bent, "phi2": 0.5 * np.sin(60 * TIME**2), "x": TIME.copy()}
    return Recording("run.csv", TIME, channels, {})


def thinned(recording, *rows):
    kept = np.delete(np.arange(len(recording)), rows)
    channels = {n: v[kept] for n, v in recording.channels.items()}
    return replace(recording, time=recording.time[kept], channels=channels)


@pytest.mark.parametrize("corner", [0.5005, 0.501, 0.5018])
def test_a_corner_in_a_hole_is_found_again(corner):
    whole = order(corner)
    back = with_lost_rows(thinned(whole, 501, 502))
    assert back.time == pytest.approx(whole.time, abs=1e-12)
    assert back["phi1"] == pytest.approx(whole["phi1"], abs=1e-9)
    assert np.flatnonzero(np.isnan(back["x"])).tolist() == [501, 502]


def test_a_curve_is_led_through_with_its_slopes():
    whole, lost = order(), [700, 701, 1500]
    cut = thinned(whole, *lost)
    straight = np.interp(TIME, cut.time, cut["phi2"]) - whole["phi2"]
    curved = with_lost_rows(cut)["phi2"] - whole["phi2"]
    assert np.abs(curved).max() < np.abs(straight).max() / 5


@pytest.mark.parametrize(
    "uneven",
    [
        pytest.param(thinned(order(), *range(500, 520)), id="pause"),
        pytest.param(thinned(order(), *range(1, 1900, 3)), id="pace of its own"),
        pytest.param(replace(order(), time=TIME + 2e-4 * np.sin(np.arange(2000))), id="jitter"),
    ],
)
def test_a_pause_or_an_uneven_clock_is_left_as_it_is(uneven):
    assert with_lost_rows(uneven) is uneven


@pytest.mark.parametrize(("machine", "metadata"), [("gt2_printer", {}), ("light_bench", LOOP)])
def test_a_replay_without_some_rows_is_that_of_all(machine, metadata):
    whole = replace(order(), metadata=metadata)
    machine = load_machine(machine)
    if metadata:
        machine = replace(machine, drive="dc")
    lost = [501, 502, 900, 1300]
    all_rows, some = simulate(machine, whole), simulate(machine, thinned(whole, *lost))
    assert len(some) == len(whole) - len(lost)
    straight = thinned(all_rows, *lost)
    assert np.abs(some["x"] - straight["x"]).max() < 1e-6
