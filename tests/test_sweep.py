"""Sweeps: the same results whoever does them and however often they are stopped."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.corners import corner_table
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.sweep.chunk import draw, run_chunk
from corexy_fmi.sweep.folder import Folder
from corexy_fmi.sweep.measure import MEASURES, measured, settling, windows
from corexy_fmi.sweep.parquet import MISSING
from corexy_fmi.sweep.plan import Plan
from corexy_fmi.sweep.run import sweep
from corexy_fmi.sweep.vary import base_vector, read_ranges
from corexy_fmi.sweep.workers import NO_DASK, Here, workers

SHAPE = Rectangle(0.012, 0.010, 0.05)
VARY = ("belt_axial_stiffness=500:2000:log", "backlash.motor1.gap=0:0.02")
WORDS = ("--width", "0.012", "--height", "0.01", "--speed", "0.05")


def plan(sets=200, chunk=64, vary=VARY, machine="yin2018", shape=SHAPE, **more):
    ranges, chosen = read_ranges(vary, (), load_machine(machine))
    return Plan(chosen, shape, ranges, sets, chunk=chunk, **more)


def run(what, path, jobs=1, report=lambda sets: None):
    """Do or go on with a sweep; the numbers of the chunks that were found done."""
    folder = Folder(path, what.document(), {"machine": what.machine.name})
    with workers(jobs) as (executor, ahead):
        done = folder.open()
        sweep(what, folder, done, executor, ahead, report)
    return done


def contents(path):
    """Every chunk's bytes by name."""
    return {file.name: file.read_bytes() for file in (path / "sets").iterdir()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An uninterrupted sweep."""
    pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("sweep") / "whole"
    assert run(plan(), path) == set()
    return path


def test_one_and_two_workers_give_the_same_bytes(whole, tmp_path):
    run(plan(), tmp_path / "two", jobs=2)
    assert contents(tmp_path / "two") == contents(whole)


def test_the_table_holds_every_set_once(whole):
    from pyarrow.parquet import read_table

    table = read_table(whole / "sets")
    keys = [text.partition("=")[0] for text in VARY]
    assert table.column_names == ["set", *keys, *MEASURES]
    assert sorted(table["set"].to_pylist()) == list(range(200))
    stiffness, gap = (np.array(table[key]) for key in keys)
    assert 500 <= stiffness.min() < 600 < 1700 < stiffness.max() <= 2000
    assert np.median(stiffness) == pytest.approx(1000, rel=0.15)
    assert np.corrcoef(stiffness, np.array(table["contour_error_xy"]))[0, 1] < -0.5
    assert np.median(gap) == pytest.approx(0.01, rel=0.2)
    assert table.schema.metadata[b"machine"] == b"yin2018"


def test_a_corrupt_torn_or_lost_chunk_is_redone(whole, tmp_path):
    run(plan(), tmp_path / "o")
    first, second, third, _ = sorted((tmp_path / "o" / "sets").iterdir())
    data = bytearray(first.read_bytes())
    data[len(data) // 2] ^= 1
    first.write_bytes(data)
    second.write_bytes(second.read_bytes()[:-100])
    third.unlink()
    (tmp_path / "o" / "sets" / ".000009-abcd.parquet").write_bytes(b"of a killed process")
    with (tmp_path / "o" / "chunks.jsonl").open("a") as ledger:
        ledger.write('{"chunk": 1, "ro')
    assert run(plan(), tmp_path / "o") == {3}
    assert contents(tmp_path / "o") == contents(whole)
    assert run(plan(), tmp_path / "o") == {0, 1, 2, 3}


def start(folder, jobs, sets):
    """A sweep as a user starts it, with chunks as in `plan`, in a group of its own."""
    words = ["sweep", *WORDS, "--sets", sets, "--chunk", 64, "--jobs", jobs, "--out", "o"]
    words += [word for text in VARY for word in ("--vary", text)]
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "corexy_fmi", *map(str, words)],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def wait_for_chunks(folder, count, process):
    """Until the ledger has so many lines."""
    ledger, end = folder / "o" / "chunks.jsonl", time.monotonic() + 60
    while not ledger.exists() or ledger.read_text().count("\n") < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)


def group_is_gone(group):
    """Whether no process of a group is left, in ten seconds."""
    for _ in range(200):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("jobs", [1, 2])
def test_resumed_after_a_kill_it_equals_an_uninterrupted_run(whole, tmp_path, jobs):
    process = start(tmp_path, jobs, 20000)
    wait_for_chunks(tmp_path, 2, process)
    process.kill()
    process.communicate(timeout=30)
    assert group_is_gone(process.pid)
    kept = contents(tmp_path / "o")
    assert 2 <= len(kept) < 20000 // 64
    stop_after = max(int(name[:6]) for name in kept if name[0] != ".") + 3
    resumed = plan(sets=20000)
    folder = Folder(
        tmp_path / "o",
        resumed.document(),
        {"machine": "yin2018", "surrogate": resumed.machine.surrogate},
    )
    done = folder.open()
    assert len(done) >= 2
    skipped = set(range(stop_after, resumed.chunks))  # the rest would only take time
    sweep(resumed, folder, done | skipped, Here(), 1)
    for index in range(stop_after):
        other = Folder(tmp_path / "fresh", resumed.document(), folder.about)
        other.keep(index, run_chunk(resumed, index))
    assert contents(tmp_path / "o") == contents(tmp_path / "fresh")


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_leaves_finished_chunks_and_no_mess(whole, tmp_path):
    process = start(tmp_path, 2, 100000)
    wait_for_chunks(tmp_path, 2, process)
    os.killpg(process.pid, signal.SIGINT)
    out, said = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert said == "interrupted, nothing was left half-written\n"
    assert group_is_gone(process.pid)
    names = {path.name for path in (tmp_path / "o").rglob("*") if path.is_file()}
    assert not [name for name in names if name.startswith(".")]
    resumed = plan(sets=100000)
    folder = Folder(tmp_path / "o", resumed.document(), {})
    assert len(folder.open()) == len(contents(tmp_path / "o")) >= 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"sets": 201}, "sets is 200, found 201"),
        ({"seed": 1}, "seed is 0, found 1"),
        ({"vary": VARY[:1]}, "holds another sweep"),
        ({"machine": "light_bench"}, 'machine is name = "yin2018"'),
        ({"shape": replace(SHAPE, speed=0.2)}, "rectangle is"),
    ],
)
def test_another_sweep_in_the_folder_is_refused(whole, change, said):
    before = contents(whole)
    with pytest.raises(InputError, match="holds another sweep") as told:
        run(plan(**change), whole)
    assert said in str(told.value)
    assert "\n" not in str(told.value)
    assert contents(whole) == before


def test_a_folder_of_something_else_is_refused(whole, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"found files and no manifest\.json"):
        run(plan(), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(InputError, match="cannot be read"):
        run(plan(), tmp_path)


def test_memory_is_bounded_no_more_in_flight_than_asked(whole, tmp_path):
    """Tasks are handed out as tables are kept, never all at once."""
    most, what = [], plan(sets=640)
    folder = Folder(tmp_path / "o", what.document(), {})

    class Counting(Here):
        handed = 0

        def submit(self, fn, /, *args, **kwargs):
            self.handed += 1
            most.append(
                self.handed
                - len(contents(tmp_path / "o") if (tmp_path / "o/sets").is_dir() else ())
            )
            return super().submit(fn, *args, **kwargs)

    sweep(what, folder, folder.open(), Counting(), 3)
    assert len(most) == 10
    assert max(most) == 3


@pytest.mark.parametrize("machine", ["yin2018", "yin2018_dc", "gt2_printer"])
@pytest.mark.parametrize("accel", [None, 2.0])
def test_measures_are_those_of_corner_table(machine, accel):
    shape = Rectangle(0.02, 0.015, 0.08, 2, accel)
    what = plan(sets=12, machine=machine, shape=shape)
    found, drive, drawn = run_chunk(what, 0), what.excitation(), draw(what, 0)
    for n in range(12):
        vector = base_vector(what.machine)
        for r in what.ranges:
            vector[r.place.index] = drawn[r.place.key][n]
        path = run_lanes(
            bundled_layout(), drive, np.tile(vector, (8, 1)), dc=what.machine.drive == "dc"
        )[0]
        table = corner_table(
            Recording("run", drive.time, dict(zip("xy", path, strict=True))), shape
        )
        for turn, short in (("x->y", "xy"), ("y->x", "yx")):
            errors = [c.contour_error for c in table if c.turn == turn]
            beyond = max(c.overshoot for c in table if c.turn == turn)
            worst = max(errors, key=abs)
            assert found[f"contour_error_{short}"][n] == pytest.approx(worst, rel=1e-3, abs=1e-8)
            assert found[f"overshoot_{short}"][n] == pytest.approx(beyond, rel=1e-3, abs=1e-8)


def test_settling_of_known_decays():
    """exp(-t / tau) from 1 mm is within 10 um after tau ln 100; an endless swing never is."""
    time_, taus = np.linspace(0, 1.5, 15001), np.array([0.01, 0.05])
    after = np.maximum(time_ - 1.0, 0)
    paths = np.zeros((3, 2, len(time_)))
    paths[:2, 0] = 1e-3 * np.exp(-after / taus[:, None])
    paths[2, 1] = 1e-3 * np.cos(300 * after)
    found = settling(paths, time_, 1.0, 1e-5)
    assert found[:2] == pytest.approx(taus * np.log(100), abs=2e-4 + 1e-4)
    assert np.isnan(found[2])


def test_a_path_that_broke_down_is_nan_and_warns_of_nothing():
    time_ = plan().order().time
    paths = np.full((2, 2, len(time_)), np.nan)
    found = measured(SHAPE, windows(SHAPE, time_), time_, paths, 1e-5)
    assert all(np.isnan(found[name]).all() for name in MEASURES)


def test_draws_depend_on_seed_and_chunk_alone():
    key = "belt_axial_stiffness"
    first, again, other = plan(), plan(sets=100000), plan(seed=1)
    assert np.array_equal(draw(first, 0)[key], draw(again, 0)[key])
    assert not np.isin(draw(first, 1)[key], draw(first, 0)[key]).any()
    assert not np.isin(draw(other, 0)[key], draw(first, 0)[key]).any()


def test_spread_is_around_the_machines_value():
    machine = load_machine("yin2018")
    (found,), _ = read_ranges((), ("carriage_mass=2",), machine)
    value = machine.parameters["carriage_mass"]
    assert (found.low, found.high, found.log) == (value / 2, value * 2, True)


BAD = {
    "key": ("carriage_mas=1:2", "nearest known: carriage_mass"),
    "effect": ("backlsh.motor1.gap=0:1", "nearest known: backlash.motor1.gap"),
    "location": ("backlash.motor3.gap=0:0.1", "nearest known: backlash.motor"),
    "dc parameter": ("motor_torque_gain=0.1:0.2", "unknown parameter of a stepper machine"),
    "radius": ("pulley_radius=0.004:0.005", "expected a sweep for each radius"),
    "form": ("carriage_mass", "expected KEY=LOW:HIGH"),
    "scale": ("carriage_mass=1:2:logarithmic", "expected KEY=LOW:HIGH"),
    "number": ("carriage_mass=a:2", "found 'a', expected a finite number"),
    "nan": ("carriage_mass=nan:2", "found 'nan', expected a finite number"),
    "bounds": ("carriage_mass=0.1:200", "found 200, expected a value from 0.001 to 100 [kg]"),
    "order": ("carriage_mass=2:1", "expected LOW below HIGH"),
    "log of zero": ("pulley_mass=0:1:log", "with log, expected LOW above 0"),
    "needed number": ("backlash.motor1.grip=0.1:1", "is neither in the machine nor varied"),
    "clip": ("clip_spacing=0.1:0.3", "clip_spacing reaches 0.3 m"),
    "stage": ("bridge_pulley_spacing=0.062:0.3", "leaves the stage"),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=BAD)
def test_bad_ranges(text, said):
    with pytest.raises(InputError) as told:
        plan(vary=(text,))
    assert said in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("change", [{"sets": 0}, {"chunk": 0}, {"within": float("nan")}])
def test_bad_counts(change):
    (name,) = change
    with pytest.raises(InputError, match=f"{name}: found"):
        plan(**change)


def test_absent_packages_are_told_in_one_line(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError) as told:
        run(plan(), tmp_path / "o")
    assert str(told.value) == MISSING
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError) as told, workers(1, "nowhere:8786"):
        pass
    assert str(told.value) == NO_DASK


def test_a_worker_that_died_is_told_in_one_line(whole, tmp_path, monkeypatch):
    monkeypatch.setattr("corexy_fmi.sweep.run.run_chunk", die)
    with pytest.raises(InputError, match="a worker process died"):
        run(plan(), tmp_path / "o", jobs=2)


def die(what, index):
    """A task that ends its process."""
    os._exit(3)


def test_the_command_says_where_and_goes_on(whole, tmp_path):
    for found in ("0", "200"):
        process = start(tmp_path, 1, 200)
        out, said = process.communicate(timeout=60)
        assert (process.returncode, said) == (0, "")
        assert "surrogate" in out
        assert (f"found done: {found} sets" in out) == (found != "0")
    manifest = json.loads((tmp_path / "o" / "manifest.json").read_text())
    assert manifest["vary"][0]["scale"] == "log"
    assert [len(contents(p)) for p in (tmp_path / "o", whole)] == [4, 4]
