"""Recordings of voltages that begin in motion: until rest is forgotten nothing is compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import ASIDE, BACKLASH, machine, other_motion, record, rich_motion, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import GAP, make_run, split_in_time
from corexy_fmi.engine.judging.onset import forgotten, settled_in
from corexy_fmi.simulate import simulate

DC = machine("yin2018_dc")
CUT = 0.5  # [s], in the middle of a stroke
LOOSE = dict.fromkeys(
    ("motor_damping_gain", "carriage_viscous_friction", "pulley_viscous_friction"), 0.01
)


def volts(recording, since=0.0):
    """The rows from a time [s] on, without references and the loop that follows them."""
    rows = recording.time >= since
    channels = {n: v[rows] for n, v in recording.channels.items() if n not in ("phi1", "phi2")}
    time = recording.time[rows] - recording.time[rows][0]
    return replace(recording, time=time, channels=channels, metadata={})


def settled(recording, chosen=DC):
    """A run of the whole recording, the same as it is settled, and what is said."""
    run = make_run(recording, chosen, "train")
    (left,), found = settled_in([run], chosen)
    return run, left, found


@pytest.fixture(scope="module")
def whole():
    return record(with_effects(DC, **ASIDE), rich_motion())


def test_a_begin_in_motion_is_told_and_not_compared(whole):
    run, left, (finding,) = settled(volts(whole, CUT))
    wait = forgotten(DC, run.excitation)
    assert "begins in motion, driven by voltages alone" in finding.text
    assert f"first {1e3 * wait:.0f} ms" in finding.fix
    assert left.excitation is run.excitation
    for given, kept in zip(run.samples, left.samples, strict=True):
        late = run.excitation.time[given.index] >= wait
        assert 0.9 < late.mean() < 1
        assert (kept.value == given.value[late]).all()


def test_what_begins_at_rest_stays(whole):
    run, left, found = settled(volts(whole))
    assert left is run
    assert found == []


def test_the_part_kept_back_stays(whole):
    first, last = split_in_time(volts(whole, CUT), DC, GAP)
    (begun, later), found = settled_in([first, last], DC)
    assert begun.count < first.count
    assert later is last
    assert len(found) == 1


@pytest.mark.parametrize("noise", [1e-6, 3e-3])
def test_noise_is_no_motion(noise):
    assert settled(volts(record(DC, rich_motion(), noise=noise)))[2] == []


def test_references_tell_how_it_began(whole):
    rows = whole.time >= CUT
    channels = {n: v[rows] for n, v in whole.channels.items()}
    run, left, found = settled(replace(whole, time=whole.time[rows], channels=channels))
    assert left is run
    assert found == []


def test_by_then_a_replay_from_rest_is_as_fast():
    """The same voltages from rest at the first row, and in the middle of the whole run."""
    shown = record(DC, rich_motion(), noise=0.0)
    truth, replayed = (simulate(DC, volts(shown, since)) for since in (0.0, CUT))
    rows, wait = truth.time >= CUT, forgotten(DC, settled(volts(shown, CUT))[0].excitation)
    off = np.abs(replayed["vx"] - truth["vx"][rows]) / np.abs(truth["vx"]).max()
    assert off[replayed.time < wait].max() > 0.5
    assert off[replayed.time >= wait].max() < 0.01


def test_a_stage_that_never_forgets_is_told(whole):
    """Nothing damps it: a start at rest would show all along."""
    run, left, (finding,) = settled(volts(whole, CUT), with_effects(DC, **LOOSE))
    assert finding.fix.endswith("a start at rest is assumed here.")
    assert left is run


@pytest.mark.long
@pytest.mark.parametrize("cause", [(), (BACKLASH,)], ids=["nothing", "backlash"])
def test_a_start_in_motion_is_no_cause(cause):
    """It was a force along x without a name."""
    truth = with_effects(DC, *cause, **ASIDE)
    train = volts(record(truth, rich_motion(), "train.csv", seed=1, noise=1e-5), CUT)
    judge = volts(record(truth, other_motion(), "judge.csv", seed=2, noise=1e-5), 0.2)
    found = diagnose([train], [judge], DC, jobs=2).document
    named = [(e["name"], e["location"]) for e in found["effects"]]
    assert named == [(use.name, use.location) for use in cause]
    assert found["verdict"] == ("explained" if cause else "nothing_missing")
