"""Recordings that begin in motion: led in evenly, how far off that is free, and told so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import (
    ASIDE,
    BACKLASH,
    machine,
    other_motion,
    record,
    rich_motion,
    with_effects,
)
from kernel_helpers import LOOP, MACHINES, STEP, angles_of, excitation, run, vector

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import GAP, make_run, split_in_time
from corexy_fmi.engine.judging import moving
from corexy_fmi.engine.judging.local import _as_clean
from corexy_fmi.engine.judging.moving import begun, begun_alike, told
from corexy_fmi.kernel.call import PUSH, Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import chain, line, rest

CUT = 0.3  # [s] in the middle of the first stroke of the kit's motions


def ramp(first, last, row=1e-3, radius=5e-3, **options):
    """Even motion along both axes from one time [s] to another."""
    time = np.arange(round(first / row), round(last / row) + 1) * row
    path = np.column_stack([-0.01 + 0.05 * time, 0.005 - 0.02 * time])
    return Excitation(time, *angles_of(path, radius).T, **options)


@pytest.mark.parametrize("name", MACHINES)
def test_a_lead_in_ends_where_a_long_approach_does(name):
    chosen = load_machine(name)
    radius, values = chosen.parameters["pulley_radius"], vector(name)
    whole = run(ramp(-2.0, 0.3, radius=radius), values)[:, 2000:]
    led = run(ramp(0.0, 0.3, radius=radius, lead=0.5), values)
    still = run(ramp(0.0, 0.3, radius=radius), values)
    assert np.abs(led - whole).max() < 5e-6 < 4e-5 < np.abs(still - whole).max()


@pytest.mark.parametrize("motors", ["stepper", "dc"])
def test_lead_and_push_agree_with_plain_python(motors):
    dc = motors == "dc"
    values = vector("yin2018_dc" if dc else "yin2018", [("backlash", "motor1", (0.02,))])
    e = ramp(0.0, 0.05, lead=0.05, **(LOOP if dc else {}))
    push = np.array([[1e-4, -2e-4, 0.01, -0.02, 0.02, -0.01, 0.5, 1.0]])
    found = run(e, values, push=push, limit=STEP, dc=dc)
    slow = run_reference(bundled_layout(), e, values, push=push[0], limit=STEP, dc=dc)
    assert np.abs(found - [slow["x"], slow["y"]]).max() < 1e-12
    assert np.abs(found - run(e, values, limit=STEP, dc=dc)).max() > 1e-5
    block = run_lanes(bundled_layout(), e, np.repeat(values[None], 3, axis=0), limit=STEP, dc=dc,
                      push=push * [[0.0], [1.0], [2.0]])  # fmt: skip
    assert (block[1] == found).all()


def test_a_push_moves_the_first_row_by_itself():
    push = np.zeros((1, len(PUSH)))
    push[0, :2] = 1e-4, -2e-4
    e = ramp(0.0, 0.01, lead=0.1)
    off = run(e, vector(), push=push)[:, 0] - run(e, vector())[:, 0]
    assert off == pytest.approx(push[0, :2], abs=1e-15)


def test_without_a_lead_nothing_changes():
    e = excitation()
    assert (run(e, vector()) == run(replace(e, lead=0.0), vector(), push=np.ones((1, 8)))).all()


def test_push_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"push \(1, 4\), expected \(1, 8\)"):
        run(ramp(0.0, 0.01, lead=0.1), vector(), push=np.zeros((1, 4)))


def cut(recording, since=CUT):
    """The rows from a time [s] on."""
    rows = recording.time >= since
    channels = {n: v[rows] for n, v in recording.channels.items()}
    return replace(recording, time=recording.time[rows], channels=channels)


def found_moving(recording, chosen):
    return begun([make_run(recording, chosen, "train")], bundled_layout(), chosen)[0]


@pytest.mark.parametrize("name", ["yin2018", "light_bench", "yin2018_dc"])
def test_a_cut_recording_is_seen_to_begin_in_motion(name):
    """By a machine file that is off, too; the whole recording begins at rest."""
    chosen = machine(name)
    whole = record(with_effects(chosen, **ASIDE), rich_motion())
    assert found_moving(cut(whole), chosen).moving
    assert not found_moving(whole, chosen).moving


def test_a_stage_that_still_swings_is_seen():
    """The inputs rest at the first row, the stage does not."""
    chosen = machine("light_bench")
    rings = chain(rest((0, 0), 0.1), line((0, 0), (0.03, 0), 0.1, 20.0), rest((0.03, 0), 0.6),
                  line((0.03, 0), (0, 0), 0.1, 2.0), rest((0, 0), 0.3))  # fmt: skip
    whole = record(with_effects(chosen, **ASIDE), rings)
    assert found_moving(cut(whole, 0.41), chosen).moving
    assert not found_moving(cut(whole, 0.98), chosen).moving


@pytest.mark.parametrize("name", ["yin2018", "light_bench"])
def test_a_jump_into_motion_begins_at_rest(name):
    """A constant-speed run from rest has the inputs of one that is cut, and another response."""
    chosen = machine(name)
    e = ramp(0.0, 0.5, radius=chosen.parameters["pulley_radius"])
    whole = record(with_effects(chosen, **ASIDE), rich_motion())
    still = run(e, vector(name))
    noisy = still + np.random.default_rng(1).normal(0, 2e-5, still.shape)
    channels = {"phi1": e.input1, "phi2": e.input2, "x": noisy[0], "y": noisy[1]}
    assert not found_moving(replace(whole, time=e.time, channels=channels), chosen).moving


def test_parts_of_a_recording_begin_as_it_does():
    """The last part without --holdout, and both where an effect belongs to one recording."""
    chosen = machine()
    early, late = split_in_time(cut(record(chosen, rich_motion())), chosen, GAP)
    known = begun([early], bundled_layout(), chosen)
    after = begun_alike([late], known)[0]
    assert after.excitation.lead == known[0].excitation.lead > 0
    assert after.samples is late.samples
    assert after.role == "holdout"
    assert _as_clean(early, known[0]).pace == known[0].pace > 0


def test_the_user_is_told():
    chosen = machine()
    runs = [found_moving(r, chosen) for r in (cut(record(chosen, rich_motion())),)]
    assert [f.text for f in told([*runs, *runs])] == [f"{runs[0].name}: begins in motion"]
    assert told([replace(r, pace=0.0) for r in runs]) == []


def test_where_neither_begin_leaves_anything_it_is_at_rest(monkeypatch):
    """A still recording without noise: nothing is divided by what a begin at rest leaves."""
    monkeypatch.setattr(moving, "_squares", lambda *_: 0.0)
    assert not found_moving(cut(record(machine(), rich_motion())), machine()).moving


@pytest.mark.long
@pytest.mark.parametrize("name", ["yin2018", "yin2018_dc"])
def test_a_cut_recording_of_nothing_is_nothing(name):
    """It was constant_force with missed_steps, for sure, before."""
    chosen = machine(name)
    truth = with_effects(chosen, **ASIDE)
    files = [cut(record(truth, motion)) for motion in (rich_motion(), other_motion())]
    found = diagnose(files[:1], files[1:], chosen, jobs=2).document
    assert found["verdict"] == "nothing_missing"
    assert found["heldout"]["rms_retuned"] < 1.05 * found["heldout"]["noise_std"]


@pytest.mark.long
def test_nor_is_it_without_data_kept_back():
    truth = with_effects(machine(), **ASIDE)
    found = diagnose([cut(record(truth, rich_motion()))], [], machine(), jobs=2).document
    assert found["verdict"] == "nothing_missing"


@pytest.mark.long
def test_a_cut_recording_still_names_the_cause():
    chosen = machine()
    truth = with_effects(chosen, BACKLASH, **ASIDE)
    files = [cut(record(truth, motion)) for motion in (rich_motion(), other_motion())]
    found = diagnose(files[:1], files[1:], chosen, jobs=2).document
    assert [(e["name"], e["location"]) for e in found["effects"]] == [("backlash", "motor1")]
