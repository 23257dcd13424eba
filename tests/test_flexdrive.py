"""Two carts on a spring, recorded by others: machine, import and page."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import flexdrive
from benchmarks.outcome import RESULTS
from corexy_fmi.engine.judging.locate import windows
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import read_recording, write_recording
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.simulate import simulate

real = pytest.mark.skipif(
    not flexdrive.DATA.is_dir(), reason="the recordings of flexdrive are not beside the checkout"
)


def recording(name):
    path = flexdrive.DATA / flexdrive.FILE.format(name)
    return import_columns(path, flexdrive.MAPS, {"motors": "1", "zero": "vx, vy"}, 1.0)


def results():
    return json.loads((RESULTS / "flexdrive.json").read_text(encoding="utf-8"))


def test_the_page_shows_the_stored_numbers():
    assert flexdrive.rendered(results()) == flexdrive.PAGE.read_text(encoding="utf-8")


def test_both_outputs_are_judged_on_every_sine():
    held = [r for r in results()["run"]["fit"] if r["role"] == "holdout"]
    assert {(r["recording"], r["channel"]) for r in held} >= {  # what is local: also on last parts
        (f"{name}.csv", channel) for name in flexdrive.SINES for channel in ("vx", "vy")
    }


@real
@pytest.mark.parametrize("name", flexdrive.SQUARES)
def test_speeds_differ_by_direction(name):
    found = flexdrive.by_direction(recording(name))
    for forward, backward in zip(found["forward"], found["backward"], strict=True):
        assert 0.07 < forward < 0.15
        assert 0.002 < forward + backward < 0.015


@real
@pytest.mark.parametrize("name", ["2", "sine_1"])
def test_the_guessed_machine_moves_like_the_rig(name):
    run = recording(name)
    told = simulate(load_machine("flexdrive"), run)
    for channel in ("vx", "vy"):
        error = run[channel] - told[channel]
        assert np.sqrt(np.mean(error**2)) < 0.2 * np.std(run[channel])


def test_a_simulated_run_can_be_replayed(tmp_path):
    from typer.testing import CliRunner

    from corexy_fmi.cli import app

    reference = read_recording(flexdrive.ROOT / "models" / "flexdrive" / "reference.csv")
    write_recording(reference, tmp_path / "order.csv")
    words = ["simulate", str(tmp_path / "order.csv"), "--machine", "flexdrive", "--out"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "run.csv")])
    assert done.exit_code == 0, done.output
    assert read_recording(tmp_path / "run.csv").metadata["motors"] == "1"


@pytest.mark.parametrize("channels", [("vx", "vy"), ("x", "vx"), ("phi1_meas",)])
def test_a_mismatch_is_located_whatever_was_measured(channels):
    time = np.arange(0, 1, 1e-3)
    samples = [SimpleNamespace(channel=c, index=np.arange(len(time))) for c in channels]
    run = SimpleNamespace(name="a.csv", samples=samples, excitation=SimpleNamespace(time=time))
    late = np.where((time > 0.5) & (time < 0.6), 1.0, 0.0)
    quiet = np.random.default_rng(0).normal(0, 0.01, len(time))
    retuned = SimpleNamespace(run=run, errors=[late + quiet for _ in channels])
    explained = SimpleNamespace(run=run, errors=[quiet for _ in channels])
    proof = SimpleNamespace(replays={"retuned": [retuned], "explained": [explained]})
    (name, begin, end, share), *_ = windows(proof)
    assert name == "a.csv"
    assert begin == pytest.approx(0.5, abs=0.1)
    assert end == pytest.approx(0.6, abs=0.11)
    assert share > 0.9
