"""A log whose rows are far apart cuts curves: no cause, and put right where samples say so."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import (
    BACKLASH,
    MISMATCH,
    machine,
    named,
    other_motion,
    record,
    rich_motion,
    with_effects,
)

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.between_rows import PARTS, smooth
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

APART = 0.01  # [s]
BENCH = "light_bench"
TOLD = "commands are logged every 10 ms"


def thinned(recording):
    """Every 10 ms of what was recorded at 1 kHz."""
    time = np.arange(0.0, recording.time[-1], APART)
    rows = {n: np.interp(time, recording.time, v) for n, v in recording.channels.items()}
    return replace(recording, time=time, channels=rows)


def files(*uses):
    """Both recordings of a truth, thinned."""
    truth = with_effects(machine(BENCH), *uses)
    return [
        [thinned(record(truth, motion, name, seed=seed, noise=1e-5))]
        for motion, name, seed in (
            (rich_motion(), "train.csv", 1),
            (other_motion(), "judge.csv", 2),
        )
    ]


@pytest.mark.parametrize(
    "uses", [(), (BACKLASH,), (MISMATCH,)], ids=["nothing", "play", "mismatch"]
)
def test_what_a_log_cuts_is_no_cause_and_hides_none(uses):
    document = diagnose(*files(*uses), machine(BENCH), jobs=2).document
    assert named(document) == {(u.name, u.location) for u in uses}
    assert document["verdict"] == ("explained" if uses else "nothing_missing")
    assert any(TOLD in f["text"] for f in document["findings"])


def record_of(order):
    """What a machine without a fault does on commands, and its noise."""
    response, random = simulate(machine(BENCH), order), np.random.default_rng(4)
    noisy = {n: response[n] + 1e-5 * random.normal(size=len(order)) for n in ("x", "y")}
    return replace(order, channels={**order.channels, **noisy})


def test_straight_lines_stay_where_the_stage_followed_them():
    """The same rows, which the machine played as they are."""
    judged = []
    for [recording] in files():
        told = {n: recording[n] for n in ("phi1", "phi2")}
        played = record_of(replace(recording, channels=told))
        judged.append([played])
    document = diagnose(*judged, machine(BENCH), jobs=2).document
    assert document["verdict"] == "nothing_missing"
    assert not any(TOLD in f["text"] for f in document["findings"])


def test_a_curve_meets_every_row_and_keeps_the_samples():
    """To 1e-12 rad; and to the third power of rows' distance of a sine: 1e-4 of its size."""
    time = np.arange(0, 1, APART)
    wave = 0.5 * np.sin(2 * np.pi * 3 * time)
    given = Recording("wave.csv", time, {"phi1": wave, "phi2": 0 * wave, "x": wave, "y": wave})
    run = make_run(given, machine(), "train")
    curved = smooth(run)
    assert np.abs(curved.excitation.input1[::PARTS] - wave).max() < 1e-12
    exact = 0.5 * np.sin(2 * np.pi * 3 * curved.excitation.time)
    assert np.abs(curved.excitation.input1 - exact).max() < 5e-5
    for before, after in zip(run.samples, curved.samples, strict=True):
        assert (curved.excitation.time[after.index] == time[before.index]).all()
        assert (after.value == before.value).all()
    assert smooth(curved) is curved


def test_an_angle_that_is_told_now_and_then_is_led_through_those_rows():
    """Behind its last one it stays, but for what a spline's corner rings."""
    time = np.arange(0, 1, 1e-3)
    wave = np.where(np.arange(1000) % 20 == 0, np.sin(6 * time), np.nan)
    wave[861:] = np.nan
    channels = {"phi1": wave, "phi2": 0 * time, "x": 0.1 * time, "y": 0.1 * time}
    curved = smooth(make_run(Recording("wave.csv", time, channels), machine(), "train"))
    course = curved.excitation.input1
    early = curved.excitation.time < 0.6
    assert np.abs(course - np.sin(6 * curved.excitation.time))[early].max() < 1e-5
    assert np.abs(course[5 * 865 :] - course[-1]).max() < 1e-6


def test_held_voltages_and_references_are_no_curves():
    order = record(machine("yin2018_dc"), other_motion())
    run = make_run(order, machine("yin2018_dc"), "train")
    assert smooth(run) is run
