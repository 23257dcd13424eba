"""`corexy fleet`: what is found, done once, kept, and told."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import fleet_kit
import pytest
from engine_kit import DELAY, machine, other_motion, record, short_motion, with_effects
from fleet_kit import make_fleet
from sweep_kit import group_is_gone

from corexy_fmi.commands.fleet_task import diagnose_parcel
from corexy_fmi.errors import InputError
from corexy_fmi.files import alone_in
from corexy_fmi.fleet.cases import find_machines, read_parcel
from corexy_fmi.fleet.run import diagnose_fleet
from corexy_fmi.fleet.store import Store
from corexy_fmi.machine import save_machine
from corexy_fmi.recording import write_recording
from corexy_fmi.sweep.workers import Here

HERE = Path(__file__).parent


def run(folder, task=fleet_kit.quick, executor=None, ahead=1):
    """The rows, and the names that were not found done."""
    fresh = []
    rows = diagnose_fleet(
        find_machines(folder), None, Store(folder), task, executor or Here(), ahead,
        lambda row, found: found or fresh.append(row["machine"]),
    )  # fmt: skip
    return rows, fresh


def start(folder, task, *words):
    """The command as a user starts it, in a group of its own."""
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "fleet_kit", task, "fleet", *map(str, words)],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(HERE), *sys.path])},
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def wait_for(path, process):
    end = time.monotonic() + 60
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("name", "judges"),
    [("holdout.csv", True), ("holdout_2.csv", True), ("H1.csv", True), ("H.csv", True),
     ("run.csv", False), ("home.csv", False), ("my_holdout.csv", False)],
)  # fmt: skip
def test_names_tell_which_recordings_judge(tmp_path, name, judges):
    for each in {name, "train.csv"}:
        (tmp_path / each).write_text("")
    parcel = read_parcel(tmp_path)
    assert (name in parcel.holdout, name in parcel.train) == (judges, not judges)


def test_a_machine_file_of_its_own_goes_before_the_one_for_all(tmp_path):
    make_fleet(tmp_path, 2)
    (tmp_path / "m0" / "machine.toml").write_text("own")
    (tmp_path / "all.toml").write_text("for all")
    own, other = (read_parcel(tmp_path / n, str(tmp_path / "all.toml")) for n in ("m0", "m1"))
    assert (own.files["machine.toml"], other.files["machine.toml"]) == (b"own", b"for all")
    assert read_parcel(tmp_path / "m1", "light_bench").machine == "light_bench"
    assert read_parcel(tmp_path / "m1").machine is None


def test_each_is_done_once_and_again_only_where_something_changed(tmp_path):
    make_fleet(tmp_path)
    first, fresh = run(tmp_path)
    assert fresh == ["m0", "m1", "m2", "m3"]
    assert run(tmp_path) == (first, [])
    with (tmp_path / "m1" / "run.csv").open("a") as file:
        file.write("0.002,0,0,0,0\n")
    (tmp_path / "m2" / "result" / "diagnosis.json").write_text("torn")
    shutil.rmtree(tmp_path / "m3" / "result")
    assert run(tmp_path)[1] == ["m1", "m2", "m3"]
    assert run(tmp_path)[1] == []


def test_what_cannot_be_diagnosed_is_a_row_and_tried_again(tmp_path):
    make_fleet(tmp_path, 2)
    (tmp_path / "empty").mkdir()
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "run.csv").write_text("time,phi1,phi2,x\n0,0,0,0\n0.001,0,b,0\n")
    for fresh in (["m0", "m1"], []):
        rows, done = run(
            tmp_path, lambda p: (diagnose_parcel if p.name == "torn" else fleet_kit.quick)(p)
        )
        assert sorted(set(done) - {"empty", "torn"}) == fresh
    errors = {row["machine"]: row["error"] for row in rows}
    assert errors["m0"] is errors["m1"] is None
    assert errors["empty"].startswith("no recordings, expected *.csv")
    assert errors["torn"].startswith("run.csv, line 3, column phi2: found 'b', expected")
    with (tmp_path / "fleet.csv").open() as file:
        table = {row["machine"]: row for row in csv.DictReader(file)}
    assert (table["m0"]["causes"], table["m0"]["places"]) == ("backlash", "motor1")
    assert table["torn"]["error"] == errors["torn"]
    assert json.loads((tmp_path / "fleet.json").read_text())["machines"] == rows


def test_two_runs_at_once_do_not_spoil_each_other(tmp_path):
    make_fleet(tmp_path, 1)
    with alone_in(tmp_path), pytest.raises(InputError, match="another run is at work"):
        run(tmp_path)
    assert not (tmp_path / "fleet.csv").exists()
    assert run(tmp_path)[1] == ["m0"]


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(("how", "status"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_stopped_midway_it_ends_at_once_and_goes_on_later(tmp_path, how, status):
    make_fleet(tmp_path)
    process = start(tmp_path, "slow", ".", "--jobs", 2)
    for n in (0, 1):
        wait_for(tmp_path / f"m{n}" / "result" / "row.json", process)
    (os.killpg if how == signal.SIGINT else os.kill)(process.pid, how)
    out, said = process.communicate(timeout=30)
    assert (process.returncode, out) == (status, "")
    if how == signal.SIGINT:
        assert said == "interrupted, nothing was left half-written\n"
        assert not list(tmp_path.rglob(".*"))
    assert group_is_gone(process.pid)
    assert run(tmp_path)[1] == ["m2", "m3"]
    assert not list(tmp_path.rglob(".*"))


@pytest.mark.parametrize(
    "stray", ["m0/.result-0a/x", "m0/result/.row-0a.json", ".fleet-0a.csv", ".fleet-0a.json"]
)
def test_what_a_killed_run_was_writing_is_swept_by_the_next(tmp_path, stray):
    make_fleet(tmp_path, 1)
    (tmp_path / stray).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / stray).write_text("half")
    run(tmp_path)
    assert not list(tmp_path.rglob(".*"))


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_a_worker_that_died_is_told_with_its_machine(tmp_path):
    make_fleet(tmp_path)
    process = start(tmp_path, "deadly", ".", "--jobs", 2)
    out, said = process.communicate(timeout=60)
    assert (process.returncode, out) == (2, "")
    assert said.startswith("a worker process died with ")
    assert "m2" in said.split(" under way")[0]
    assert said.count("\n") == 1


class Broken(Here):
    """An executor on which machine m1 ends with an exception."""

    def __init__(self, error):
        self.error = error

    def submit(self, fn, /, parcel):
        if parcel.name != "m1":
            return super().submit(fn, parcel)
        future = Future()
        future.set_exception(self.error)
        return future


def test_what_dies_on_a_cluster_is_its_machines_error(tmp_path):
    make_fleet(tmp_path)
    rows, _ = run(tmp_path, executor=Broken(ValueError("killed\nworker")))
    assert [row["error"] for row in rows] == [None, "ValueError: killed worker", None, None]
    assert run(tmp_path)[1] == ["m1"]


def test_a_cluster_that_went_away_is_one_line_and_keeps_what_is_there(tmp_path):
    make_fleet(tmp_path)
    with pytest.raises(InputError, match="the cluster went away with m1 under way"):
        run(tmp_path, executor=Broken(CancelledError()))
    assert run(tmp_path)[1] == ["m1", "m2", "m3"]


class Dead(Here):
    """An executor whose processes are found dead when m1 is handed over."""

    def submit(self, fn, /, parcel):
        if parcel.name == "m1":
            raise BrokenProcessPool("dead")
        return super().submit(fn, parcel)


def test_a_worker_that_died_before_the_next_is_handed_over_is_one_line(tmp_path):
    make_fleet(tmp_path)
    with pytest.raises(InputError, match="a worker process died with m1 under way"):
        run(tmp_path, executor=Dead())
    assert run(tmp_path)[1] == ["m1", "m2", "m3"]


@pytest.mark.parametrize(
    ("make", "expected"),
    [(lambda p: None, "No such file or directory, expected a folder of machines"),
     (lambda p: p.mkdir(), "no subfolders, expected one for each machine")],
)  # fmt: skip
def test_a_folder_without_machines_is_one_line(tmp_path, make, expected):
    make(tmp_path / "fleet")
    with pytest.raises(InputError, match=expected):
        find_machines(tmp_path / "fleet")


def test_a_real_machine_is_diagnosed_as_the_command_does(tmp_path):
    kinematic = machine(fidelity="kinematic")
    truth = with_effects(kinematic, DELAY)
    home = tmp_path / "bench"
    home.mkdir()
    save_machine(kinematic, home / "machine.toml")
    for name, motion, seed in (("run.csv", short_motion(), 1), ("H1.csv", other_motion(), 2)):
        write_recording(record(truth, motion, name, seed=seed), home / name)
    rows, _ = run(tmp_path, diagnose_parcel)
    (row,) = rows
    assert (row["error"], row["verdict"]) == (None, "explained")
    assert (row["causes"], row["places"]) == (["sensor_delay"], ["sensor"])
    assert row["heldout_after"] < row["heldout_before"]
    assert (row["weak"], row["assumed"]) == (False, False)
    names = {path.name for path in (home / "result").iterdir()}
    assert {"diagnosis.json", "report.html", "machine.toml", "CoreXY.fmu", "row.json"} <= names
    held = json.loads((home / "result" / "diagnosis.json").read_text())
    assert [e["name"] for e in held["effects"]] == row["causes"]
