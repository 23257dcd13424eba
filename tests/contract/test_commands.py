"""Every command line of the contract, run as an outsider would."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy.util import read_csv

from corexy_fmi.commands.plants import Plant, run
from corexy_fmi.effects import catalogue
from corexy_fmi.errors import InputError
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import Recording, read_recording

SMALL = ("--width", "0.02", "--height", "0.015", "--speed", "0.039")
COMMANDS = (
    "demo", "rectangle", "simulate", "diagnose", "effects", "build", "plan", "import",
    "import klipper", "reproduce fig3", "reproduce fig4", "reproduce fig5", "reproduce claims",
    "sweep", "machine new", "import resonance", "import motan", "import csv", "import mat",
)  # fmt: skip
PLANTS = ("model", "fmu")
HEAVY = {"fmpy", "matplotlib", "pyarrow", "scipy", "sympy"}


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example(corexy, name):
    done = corexy(*name.split(), "--help")
    assert done.returncode == 0
    assert f"corexy {name}" in done.stdout.partition("Examples")[2]


def test_the_command_is_installed_and_helps_without_words(corexy_process):
    done = corexy_process()
    assert "rectangle" in done.stdout + done.stderr
    assert corexy_process("--help").returncode == 0


def test_help_imports_nothing_heavy():
    """What only some commands need would cost every command more than a second."""
    done = subprocess.run(
        [sys.executable, "-c", f"import corexy_fmi.cli, sys; print({HEAVY} & set(sys.modules))"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == "set()\n"


@pytest.mark.parametrize("plant", PLANTS)
def test_rectangle(corexy_process, tmp_path, plant):
    done = corexy_process("rectangle", *SMALL, "--loops", 2, "--plant", plant, "--out", "run.csv")
    assert (done.returncode, done.stderr) == (0, "")
    assert "surrogate" in done.stdout
    assert len(re.findall(r"x->y|y->x", done.stdout)) == 7
    recording = read_recording(tmp_path / "run.csv")
    assert {"phi1", "phi2", "x", "y"} <= set(recording.channels)
    assert recording.time[-1] == pytest.approx(2 * 0.07 / 0.039 + 0.5)
    corners = [key for key in recording.metadata if key.startswith("corner")]
    assert len(corners) == 7
    assert "surrogate" in recording.metadata["surrogate"]


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("machine", ["yin2018", "yin2018_dc"])
def test_rectangle_as_json(corexy, tmp_path, plant, machine):
    words = ("--machine", machine, "--plant", plant, "--json", "--out", "run.csv")
    done = corexy("rectangle", *SMALL, *words)
    assert (done.returncode, done.stderr) == (0, "")
    document = json.loads(done.stdout)
    assert [row["turn"] for row in document["corners"]] == ["x->y", "y->x", "x->y"]
    errors = [row["contour_error"] for row in document["corners"]]
    assert errors[0] > errors[1] > 1e-4
    assert all(row["overshoot"] >= 0 for row in document["corners"])
    recording = read_recording(tmp_path / "run.csv")
    assert ("V1" in recording) == (machine == "yin2018_dc")
    assert ("controller" in recording.metadata) == (machine == "yin2018_dc")


def test_both_plants_agree(corexy, tmp_path):
    for plant in PLANTS:
        corexy("rectangle", *SMALL, "--plant", plant, "--out", f"{plant}.csv")
    fmu, model = (read_recording(tmp_path / f"{plant}.csv") for plant in ("fmu", "model"))
    assert np.array_equal(fmu.time, model.time)
    for axis in ("x", "y"):
        assert np.abs(fmu[axis] - model[axis]).max() < 2e-6


def test_rectangle_with_acceleration_plot_and_plain_file(corexy, tmp_path):
    words = ("--accel", "2", "--plant", "model", "--plot", "run.png", "--plain", "--out", "run.csv")
    done = corexy("rectangle", *SMALL, *words, "--machine", "gt2_printer")
    assert done.returncode == 0
    assert "surrogate" not in done.stdout
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    assert read_csv(tmp_path / "run.csv").dtype.names[0] == "time"
    assert {path.name for path in tmp_path.iterdir()} == {"run.csv", "run.png"}


def test_simulate_replays_a_recording(corexy_process, tmp_path, measured):
    done = corexy_process("simulate", measured, "--out", "response.csv")
    assert (done.returncode, done.stderr) == (0, "")
    assert "surrogate" in done.stdout
    given, response = read_recording(measured), read_recording(tmp_path / "response.csv")
    expected = [
        "phi1", "phi2", "x", "y", "vx", "vy", "ax", "ay", "phi1_meas", "phi2_meas",
    ]  # fmt: skip
    assert list(response.channels) == expected
    assert np.array_equal(given.time, response.time)
    assert np.std(given["x"] - response["x"]) == pytest.approx(2e-5, rel=0.1)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_plain_response_is_an_input_that_fmpy_reads(corexy, tmp_path, plant):
    rows = "".join(f"{n / 100},{n / 50 if n % 2 == 0 else ''},0\n" for n in range(21))
    (tmp_path / "sparse.csv").write_text(f"time,phi1,phi2\n{rows}")
    done = corexy("simulate", "sparse.csv", "--plant", plant, "--plain", "--out", "o.csv")
    assert (done.returncode, done.stderr) == (0, "")
    assert read_csv(tmp_path / "o.csv")["phi1"] == pytest.approx(np.arange(21) / 50)


@pytest.mark.parametrize(
    ("metadata", "loop"),
    [("", load_machine("yin2018_dc").controller.line), ("# controller: pd kp=7.0 kd=0.2\n",
                                                        "pd kp=7.0 kd=0.2")],
)  # fmt: skip
def test_a_response_names_the_loop_that_was_closed(corexy, tmp_path, metadata, loop):
    rows = "".join(f"{n / 100},{n / 500},0,1,1\n" for n in range(21))
    (tmp_path / "given.csv").write_text(f"{metadata}time,phi1,phi2,V1,V2\n{rows}")
    corexy("simulate", "given.csv", "--machine", "yin2018_dc", "--out", "o.csv")
    response = read_recording(tmp_path / "o.csv")
    assert response.metadata["controller"] == loop
    corexy("simulate", "o.csv", "--machine", "yin2018_dc", "--out", "again.csv")
    assert np.array_equal(read_recording(tmp_path / "again.csv")["V1"], response["V1"])


def test_effects_lists_the_catalogue(corexy):
    listed = corexy("effects")
    assert listed.returncode == 0
    assert all(name in listed.stdout for name in catalogue())
    assert [row["name"] for row in json.loads(corexy("effects", "--json").stdout)] == list(
        catalogue()
    )


def test_effects_are_told_in_full(corexy):
    rows = json.loads(corexy("effects", "--json").stdout)
    keys = ("equation", "citation", "remedy", "check", "looks_like", "state")
    for document in rows:
        assert all(document[key].strip() for key in keys)
        assert document["locations"]
        assert set(document["drives"]) <= {"stepper", "dc"}
        for parameter in document["parameters"]:
            assert {"name", "unit", "neutral", "lower", "upper"} <= set(parameter)
    one = json.loads(corexy("effects", "racking", "--json").stdout)
    assert one == next(row for row in rows if row["name"] == "racking")


def test_one_effect_on_the_screen(corexy_process):
    shown = corexy_process("effects", "backlash").stdout
    for word in ("equation", "gap", "rad", "motor1", "stepper, dc", "citation", "remedy", "check"):
        assert word in shown


def test_units_that_differ_by_place_are_told(corexy):
    shown = corexy("effects", "periodic_disturbance")
    assert "N or N m" in shown.stdout
    one = json.loads(corexy("effects", "periodic_disturbance", "--json").stdout)
    assert one["parameters"][0]["unit"] == "N or N m"


@pytest.mark.parametrize("flavour", ["native", "python"])
def test_build(corexy_process, tmp_path, flavour):
    done = corexy_process("build", "--flavour", flavour, "--out", "built", timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    (fmu,) = (tmp_path / "built").glob("*.fmu")
    assert str(Path("built") / fmu.name) in done.stdout
    assert fmu.name == ("CoreXY.fmu" if flavour == "native" else "CoreXYPython.fmu")


def test_import_klipper(corexy_process, tmp_path):
    rows = "\n".join(f"{5 + i / 3200:.6f},9810.0,1.0,-2.0" for i in range(2000))
    (tmp_path / "raw.csv").write_text(f"#time,accel_x,accel_y,accel_z\n{rows}\n")
    done = corexy_process(
        "import", "klipper", "raw.csv", "--move", "0.100,0.125:0.110,0.125",
        "--centre", "0.125,0.125", "--speed", "0.1", "--accel", "6", "--start-offset", "-0.0008",
        "--axes", "-z,+y", "--machine", "gt2_printer", "--out", "imported.csv",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    recording = read_recording(tmp_path / "imported.csv")
    assert recording.measured == ("ax", "ay")
    assert recording["phi1"][0] == pytest.approx(-0.025 / 6.366e-3)


def test_reproduce_writes_what_it_shows(corexy, corexy_process, tmp_path):
    done = corexy_process("reproduce", "claims", "--sets", 8, "--out", "again")
    assert done.returncode == 0
    assert "surrogate" in done.stdout
    names = {path.name for path in (tmp_path / "again").iterdir()}
    assert names == {"claims.json", "claims.md", "claims.svg"}
    said = corexy("reproduce", "claims", "--sets", 8, "--out", "again", "--json")
    assert json.loads(said.stdout) == json.loads((tmp_path / "again/claims.json").read_text())


def test_inputs_that_no_machine_follows_are_told():
    time = np.array([0.0, 0.1, 0.2])
    order = Recording("far.csv", time, {"phi1": np.array([0.0, 1e308, 0.0]), "phi2": 0 * time})
    with pytest.raises(InputError, match="s, expected inputs and a machine that stay finite"):
        run(Plant.model, load_machine("yin2018"), order, {})
