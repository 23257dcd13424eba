"""Recordings too long to be fitted whole: excerpts, and the proof on all of them."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import DELAY, machine, other_motion, record, rich_motion, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data import excerpts
from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.judging import prove
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.motion import chain, rest
from corexy_fmi.simulate import simulate


@pytest.fixture(params=[2400])
def short(request, monkeypatch):
    """Long is what has more than so many rows."""
    for module in (excerpts, prove):
        monkeypatch.setattr(module, "LONG", request.param)
    return request.param


def long_run(chosen=None, noise=0.0):
    """13 s: rest, motion, a longer rest, other motion."""
    chosen = chosen or machine()
    motion = chain(rest((0, 0), 2.0), rich_motion(), rest((0, 0), 2.0), other_motion())
    return make_run(record(chosen, motion, "run.csv", noise=noise), chosen, "train")


def test_what_is_short_stays_what_it_is():
    run = long_run()
    assert excerpts.excerpts([run]) == [run]
    assert excerpts.late_part(run) is run


def test_excerpts_are_about_as_long_as_they_may_be_and_show_the_motion(short):
    run = long_run()
    found = excerpts.excerpts([run])
    assert len(found) == excerpts.PIECES
    assert short * 0.8 < sum(len(p.samples[0].index) for p in found) < short * 1.2
    assert len({p.name for p in found}) == len(found)
    speed = [float(np.ptp(p.excitation.input1)) for p in found]
    assert sum(s == 0 for s in speed) <= 1  # one shows the rest, all others move
    for p in found:
        first = p.samples[0].index[0]
        begins = p.excitation.time[0] == run.excitation.time[0]
        assert begins or p.excitation.time[first] - p.excitation.time[0] == pytest.approx(
            excerpts.LEAD, abs=2e-3
        )


def test_the_lead_in_makes_an_excerpt_follow_the_whole(short):
    """Simulated from its own beginning, an excerpt's samples are those of the whole run."""
    run = long_run()
    for p in excerpts.excerpts([run]):
        again = simulate(machine(), p.recording)
        for s in p.samples:
            # dry friction may hold it within what stiction bears, a micrometre or two
            assert np.abs(again[s.channel][s.index] - s.value).max() < 5e-6


def test_pieces_of_several_runs_keep_their_samples(short):
    runs = [long_run(), long_run()]
    runs[1] = replace(runs[1], name="other.csv")
    for p in excerpts.excerpts(runs):
        whole = runs[p.name.startswith("other")]
        begin = int(np.searchsorted(whole.excitation.time, p.excitation.time[0]))
        for s, all_of_it in zip(p.samples, whole.samples, strict=True):
            at = np.searchsorted(all_of_it.index, s.index + begin)
            assert (all_of_it.value[at] == s.value).all()
            assert s.breaks[0]


def test_voltages_are_fitted_from_the_beginning_only(short):
    run = long_run()
    driven = replace(run, excitation=replace(run.excitation, mode="voltages"))
    (found,) = excerpts.excerpts([driven])
    assert len(found.excitation.time) == short
    assert found.excitation.time[0] == driven.excitation.time[0]
    assert excerpts.late_part(driven) is driven


def test_what_counts_from_the_beginning_is_left_out():
    assert excerpts.restarted(bundled_layout()) == {"friction_warmup", "clock_drift"}


def test_a_long_recording_is_diagnosed_and_judged_whole(short):
    kinematic = machine(fidelity="kinematic")
    motion = chain(*[rich_motion(), rest((0, 0), 0.5)] * 2)
    recording = record(with_effects(kinematic, DELAY), motion, "run.csv")
    found = diagnose([recording], [], kinematic)
    document = found.document
    assert document["verdict"] == "explained"
    assert [e["name"] for e in document["effects"]] == ["sensor_delay"]
    rows = {(row["recording"], row["role"], row["channel"]) for row in document["fit"]}
    assert rows == {("run.csv", role, c) for role in ("train", "holdout") for c in "xy"}
    assert document["heldout"]["weak"]
    train = next(t for t in found.evidence.traces if t.role == "train")
    assert np.isfinite(train.measured["x"]).mean() == pytest.approx(0.7, abs=0.02)
