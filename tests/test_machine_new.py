"""Machine files out of a printer's configuration and out of answers."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.errors import InputError
from corexy_fmi.machine import load_machine
from corexy_fmi.machine.belts import BELTS, belt
from corexy_fmi.machine.new import GUESSES, Told, facts_of, lines
from corexy_fmi.machine.printer import read_printer

PRINTER = """
[include drivers.cfg]
[printer]
kinematics: corexy
max_velocity: 300
max_accel: 3000  # as bought
[stepper_x]
rotation_distance = 40
microsteps: 32
position_max: 300 ; mm
[stepper_y]
rotation_distance: 40
position_min: -10
position_max: 290
[gcode_macro PARK]
gcode:
  G28
  G1 X10: Y3
[input_shaper]
shaper_freq_x: 50
"""


@pytest.fixture
def printer(tmp_path):
    """Write a configuration, changed by pairs of (old, new)."""
    (tmp_path / "drivers.cfg").write_text("[tmc2209 stepper_x]\nmicrosteps: 8\n")

    def write(*changes):
        text = PRINTER
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "printer.cfg"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("name", ["a folder", "old [2023]", "what?"])
def test_includes_are_found_whatever_the_folder_is_called(printer, tmp_path, name):
    folder = tmp_path / name
    folder.mkdir()
    for path in (printer(), tmp_path / "drivers.cfg"):
        path.rename(folder / path.name)
    found = read_printer(folder / "printer.cfg")
    assert found == read_printer(folder / "printer.cfg")


def run(*words, answers=None):
    return CliRunner().invoke(app, [str(word) for word in words], input=answers)


def test_what_a_configuration_says(printer):
    found = read_printer(printer())
    assert found.rotation_distance == pytest.approx(0.04)
    assert found.travel == pytest.approx((0.3, 0.3))
    assert found.centre == pytest.approx((0.15, 0.14))
    assert (found.microsteps, found.full_steps, found.gear) == (32, 200, 1.0)
    assert (found.speed, found.acceleration) == pytest.approx((0.3, 3.0))
    assert found.shaper
    assert found.where["rotation_distance"].startswith("printer.cfg:8")


def test_old_step_distance_and_gears(printer):
    old = printer(("rotation_distance = 40\nmicrosteps: 32\n", "step_distance: 0.0125\n"),
                  ("rotation_distance: 40", "step_distance: 0.0125\nmicrosteps: 16"))  # fmt: skip
    with pytest.raises(InputError, match=r"stepper_y.*differs"):
        read_printer(old)  # the driver of x does 8 microsteps
    same = printer(("rotation_distance = 40\nmicrosteps: 32\n", "step_distance: 0.025\n"),
                   ("rotation_distance: 40", "step_distance: 0.0125\nmicrosteps: 16"))  # fmt: skip
    assert read_printer(same).rotation_distance == pytest.approx(0.04)
    geared = printer(("= 40", "= 40\ngear_ratio: 80:16, 2:1"),
                     (": 40", ": 40\ngear_ratio: 10:1"))  # fmt: skip
    facts = facts_of(read_printer(geared))
    assert facts["gear"].value == pytest.approx(10)
    rotor = lines(facts)["motor_inertia"]
    assert rotor.value == pytest.approx(100 * GUESSES["motor_inertia"].value)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ([("corexy", "delta")], r"printer.cfg:4 \[printer\] kinematics: found 'delta'"),
        ([("kinematics: corexy\n", "")], "found no kinematics, expected corexy"),
        ([("rotation_distance = 40", "rotation_distnce: 40")],
         r"\[stepper_x\] has no rotation_distance.*rotation_distnce"),
        ([("= 40", "= forty")], "printer.cfg:8 .*found 'forty', expected a number"),
        ([("= 40", "= 20")], "rotation_distance differs"),
        ([("= 40", "= 40\ngear_ratio: 8")], "gear_ratio: found '8'"),
        ([("position_max: 290", "position_max: -20")], "found -20 mm, expected more than"),
        ([("[stepper_y]", "[steper_y]")], r"no section \[stepper_y\].*steper_y"),
        ([("drivers.cfg", "driver.cfg")], "line 2: no file 'driver.cfg'"),
        ([("drivers.cfg", "printer.cfg")], "includes itself"),
        ([("microsteps: 32", "microsteps: -3")],
         r"\[stepper_x\] microsteps: found -3, expected a whole number from 1 on"),
        ([("microsteps: 32", "microsteps: 0.5")], "microsteps: found 0.5, expected a whole"),
        ([("max_velocity", "max velocity 3\nx")], "line 5: found 'max velocity 3'"),
    ],
)  # fmt: skip
def test_mistakes_of_a_configuration_are_told(printer, changes, told):
    with pytest.raises(InputError, match=told):
        read_printer(printer(*changes))


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(InputError, match=r"expected Klipper's printer.cfg"):
        read_printer(tmp_path / "none.cfg")


def test_the_command_writes_a_machine_that_runs(printer, tmp_path):
    out, path = tmp_path / "mine.toml", tmp_path / "run.csv"
    done = run("machine", "new", "--from", printer(), "--belt", "gt2-glass", "--belt-width",
               "9 mm", "--carriage-mass", "500 g", "--out", out)  # fmt: skip
    assert done.exit_code == 0, done.output
    machine = load_machine(out)
    assert machine.name == "mine"
    numbers = machine.parameters
    assert numbers["pulley_radius"] == pytest.approx(0.04 / (2 * np.pi))
    assert numbers["belt_axial_stiffness"] == pytest.approx(29.1e3)
    assert (numbers["carriage_mass"], machine.rel_std["carriage_mass"]) == (0.5, 0.05)
    assert (numbers["bridge_pulley_spacing"] - numbers["clip_spacing"]) > 0.3
    assert machine.rel_std["pulley_radius"] == 0.0
    drawn = run("rectangle", "--width", "0.02", "--height", "0.02", "--speed", "0.05",
                "--machine", out, "--plant", "model", "--out", path)  # fmt: skip
    assert drawn.exit_code == 0, drawn.output
    assert path.is_file()


def test_the_file_says_what_was_guessed(printer, tmp_path):
    out = tmp_path / "mine.toml"
    assert run("machine", "new", "--from", printer(), "--out", out).exit_code == 0
    machine, text = load_machine(out), out.read_text()
    told = machine.surrogate.removeprefix("guessed: ").split(", ")
    assert "belt_axial_stiffness" in told
    assert "pulley_radius" not in told
    assert "X150 Y140: --centre 0.15,0.14" in text
    assert "input shaper" in text
    for line in text.splitlines():
        found = re.match(r"(\w+) = \{value", line)
        if found:
            assert ("GUESSED" in line) == (found[1] in told)
            assert machine.rel_std[found[1]] >= 0.2 or found[1] not in told


def test_questions_and_their_ends(tmp_path):
    out = tmp_path / "asked.toml"
    answers = "40 mm\n0.25\n250 mm\n19400\n6 mm\n500 g\n\n0.4\n"
    done = run("machine", "new", "--out", out, answers=answers)
    assert done.exit_code == 0, done.output
    machine = load_machine(out)
    assert machine.parameters["belt_axial_stiffness"] == 19400
    assert machine.parameters["bridge_pulley_spacing"] == 0.4
    assert machine.rel_std["bridge_pulley_spacing"] == 0.0
    assert "bridge_mass" in machine.surrogate
    assert "carriage_mass" not in machine.surrogate


@pytest.mark.parametrize(
    ("words", "answers", "told"),
    [
        ([], "40 mm\n", "travel x: not told"),
        ([], "40 mm\n250\n", "travel x: found '250'.*at most 10"),
        (["--rotation-distance", "40 kg"], "", "rotation distance: found '40 kg'"),
        (["--belt", "gt2-glas"], "40 mm\n0.2\n0.2\n", "nearest known: gt2-glass"),
        (["--belt-width", "1"], "40 mm\n0.2\n0.2\n", "belt width: found 1 m"),
        (["--clip-spacing", "0.3", "--bridge-pulley-spacing", "0.2"], "40 mm\n0.2\n0.2\n",
         "clip_spacing: found 0.3"),
    ],
)  # fmt: skip
def test_wrong_answers_are_told(tmp_path, words, answers, told):
    done = run("machine", "new", "--out", tmp_path / "m.toml", *words, answers=answers)
    assert isinstance(done.exception, InputError)
    assert re.search(told, str(done.exception))
    assert not (tmp_path / "m.toml").exists()


def test_the_page_lists_the_belts():
    page = (Path(__file__).parents[1] / "docs" / "machine.md").read_text(encoding="utf-8")
    for known in BELTS.values():
        assert f"| `{known.name}` | {known.per_width / 1e3:.0f} N |" in page
    assert belt("gt2-glass").stiffness(6e-3) == pytest.approx(19.4e3)


def test_facts_must_be_there():
    with pytest.raises(InputError, match="travel y: not told"):
        lines({"rotation_distance": Told(0.04, ""), "travel_x": Told(0.2, "")})
