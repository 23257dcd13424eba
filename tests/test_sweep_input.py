"""What a sweep refuses, in one line."""

import sys
from dataclasses import replace

import pytest
from sweep_kit import SHAPE, VARY, WORDS, contents, plan, run
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.errors import InputError
from corexy_fmi.files import alone_in
from corexy_fmi.machine import load_machine
from corexy_fmi.sweep.parquet import MISSING
from corexy_fmi.sweep.vary import read_ranges
from corexy_fmi.sweep.workers import NO_DASK, workers


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An uninterrupted sweep."""
    pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("sweep") / "whole"
    assert run(plan(), path) == set()
    return path


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


def test_two_runs_at_once_do_not_spoil_each_other(whole):
    before = contents(whole)
    words = ["sweep", *WORDS, "--sets", "200", "--chunk", "64", "--out", str(whole)]
    words += [word for text in VARY for word in ("--vary", text)]
    with alone_in(whole):
        refused = CliRunner().invoke(app, words)
    assert isinstance(refused.exception, InputError)
    assert "another run is at work in it" in str(refused.exception)
    again = CliRunner().invoke(app, words)
    assert again.exit_code == 0, again.output
    assert contents(whole) == before
