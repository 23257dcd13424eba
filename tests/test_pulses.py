"""Step pulses: none lost, never far from the ideal angle, exact in time, and what they excite."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from benchmarks.outcome import RESULTS
from benchmarks.pulses_page import PAGE, page
from benchmarks.pulses_runs import by_jumps, modal_frequency, resonance_speed, ripple
from corexy_fmi.commands.pulses import pulses
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import circle, command, line
from corexy_fmi.pulses import EDGE, Driver, pulse_train, staircase
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import excitation, machine_vector, simulate

RADIUS = 5e-3
FINE = (1, 2, 8, 16)
MOTIONS = {
    "rectangle": Rectangle(0.02, 0.015, 0.039).motion,
    "ramps": Rectangle(0.02, 0.015, 0.1, 1, 2.0).motion,
    "circle": circle(0.01, 0.05),
}


def order(name="rectangle"):
    return command(MOTIONS[name], RADIUS)


@pytest.mark.parametrize("microsteps", FINE)
@pytest.mark.parametrize("name", MOTIONS)
def test_no_step_is_lost(name, microsteps):
    """Both ends are the microsteps nearest to the ideal angles, each pulse is one microstep."""
    smooth, driver = order(name), Driver(microsteps)
    made = staircase(smooth, driver)
    for motor in ("phi1", "phi2"):
        counts = np.diff(made[motor]) / driver.angle
        assert counts == pytest.approx(np.rint(counts), abs=1e-9)
        assert set(np.rint(counts).astype(int)) <= {-1, 0, 1}
        ends = np.floor(smooth[motor][[0, -1]] / driver.angle + 0.5)
        assert made[motor][[0, -1]] == pytest.approx(ends * driver.angle, abs=1e-12)


@pytest.mark.parametrize("microsteps", FINE)
@pytest.mark.parametrize("name", MOTIONS)
def test_the_staircase_stays_within_half_a_microstep(name, microsteps):
    smooth, driver = order(name), Driver(microsteps)
    made = staircase(smooth, driver)
    for motor in ("phi1", "phi2"):
        ideal = np.interp(made.time, smooth.time, smooth[motor])
        fastest = np.abs(np.diff(smooth[motor]) / np.diff(smooth.time)).max()
        off = np.abs(made[motor] - ideal).max()
        assert 0.4 * driver.angle < off < 0.5 * driver.angle + 6 * EDGE * fastest


def test_pulses_come_when_the_angle_passes_the_middle_between_steps():
    train = pulse_train(np.array([0.0, 1.0, 3.0]), np.array([0.0, 3.0, -1.0]), 1.0)
    assert train.time == pytest.approx([1 / 6, 0.5, 5 / 6, 1.25, 1.75, 2.25, 2.75])
    assert train.way.tolist() == [1, 1, 1, -1, -1, -1, -1]
    assert train.counts(np.array([0.0, 0.5, 0.5 + EDGE, 3.0])).tolist() == [0, 1, 2, -1]


def test_an_angle_that_rests_between_two_steps_makes_no_pulses_out_of_rounding():
    time = np.arange(100) * 1e-3
    noise = 1e-15 * np.random.default_rng(0).standard_normal(100)
    assert len(pulse_train(time, 2.5 * 0.01 + noise, 0.01).time) == 0


def test_both_motors_share_a_pulse_of_a_straight_move_in_x():
    """Full steps of 0.157 mm: 127 in 20 mm; each is one pair of rows."""
    made = staircase(command(line((0, 0), (0.02, 0), 0.02), RADIUS), Driver(1))
    edges = np.flatnonzero(np.diff(made.time) < 2 * EDGE)
    assert np.diff(made.time)[edges] == pytest.approx(np.full(127, EDGE), rel=1e-6)
    assert made.metadata["pulses"] == "microsteps=1 steps=200 motor1=+127-0 motor2=+127-0"
    for motor in ("phi1", "phi2"):
        assert np.diff(made[motor])[edges] == pytest.approx(np.full(127, np.pi / 100))
        assert np.count_nonzero(np.diff(made[motor])) == 127


def test_a_corner_is_driven_on_by_both_motors():
    """A rectangle: 95 full steps lie within the 15 mm to each end of both motors' ways."""
    made = staircase(command(Rectangle(0.02, 0.01, 0.02).motion, RADIUS), Driver(1))
    assert made.metadata["pulses"] == "microsteps=1 steps=200 motor1=+190-190 motor2=+190-190"


@pytest.mark.parametrize("count", [0, 257])
def test_a_driver_needs_a_count(count):
    with pytest.raises(InputError, match=f"microsteps: found {count}, expected"):
        Driver(count)


def test_a_motor_that_turns_too_fast_is_refused():
    with pytest.raises(InputError, match="microsteps a second, expected at most"):
        pulse_train(np.array([0.0, 1e-6]), np.array([0.0, 100.0]), 1.0)


@pytest.mark.parametrize(
    ("name", "limit", "allowed"), [("yin2018", 0.0, 0.5e-6), ("gt2_printer", 2e-5, 1e-6)]
)
def test_the_kernel_equals_an_exact_solution_with_jumps(name, limit, allowed):
    machine = load_machine(name)
    radius = machine.parameters["pulley_radius"]
    smooth = command(Rectangle(0.002, 0.001, 0.02).motion, radius)
    smooth = Recording("m", smooth.time[:260], {k: v[:260] for k, v in smooth.channels.items()})
    made = staircase(smooth, Driver(1))
    layout, vector = bundled_layout(), machine_vector(machine)[None]
    found = run_lanes(layout, excitation(machine, made), vector, limit=limit)[0].T
    assert np.abs(found - by_jumps(machine, made)).max() < allowed


@pytest.mark.parametrize("microsteps", [1, 16])
def test_the_fmu_equals_the_kernel(microsteps, tmp_path):
    """Also after the pulses were a file."""
    machine = load_machine("gt2_printer")
    made = staircase(command(MOTIONS["ramps"], 6.366e-3), Driver(microsteps))
    write_recording(made, tmp_path / "pulses.csv")
    again = read_recording(tmp_path / "pulses.csv")
    assert_array_equal(again["phi1"], made["phi1"])
    expected = simulate(machine, made)
    found = run_fmu(build_fmu(tmp_path, machine), again)
    for axis in "xy":
        assert found[axis] == pytest.approx(expected[axis], abs=1e-12)


def test_finer_microsteps_converge_to_the_smooth_command():
    """The response comes nearer in proportion to the microstep."""
    machine, smooth = load_machine("yin2018"), order()
    goal, off = simulate(machine, smooth), []
    for microsteps in (1, 4, 16, 64):
        found = simulate(machine, staircase(smooth, Driver(microsteps)))
        x = np.interp(smooth.time, found.time, found["x"])
        y = np.interp(smooth.time, found.time, found["y"])
        off.append(np.hypot(x - goal["x"], y - goal["y"]).max())
    assert np.all(np.diff(np.log(off)) < np.log(0.45))
    assert off[-1] < off[0] / 30


@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_resonance_is_where_steps_come_at_the_modal_frequency(axis):
    """Closed form: speed = modal frequency times the way of a full step."""
    machine = load_machine("gt2_printer")
    quiet = {n: 0.0 if "coulomb" in n else v for n, v in machine.parameters.items()}
    quiet = replace(machine, parameters=quiet)
    expected = resonance_speed(quiet, axis, 1)
    travel = 6.366e-3 * np.pi / 100
    assert expected == pytest.approx(modal_frequency(quiet, axis) * travel, rel=1e-12)
    speeds = expected * np.linspace(0.96, 1.04, 9)
    swings = [ripple(quiet, axis, speed, 1) for speed in speeds]
    assert speeds[np.argmax(swings)] == pytest.approx(expected, rel=0.011)
    assert max(swings) > 5 * ripple(quiet, axis, 1.5 * expected, 1)


def test_the_page_is_fresh():
    stored = json.loads((RESULTS / "pulses.json").read_text(encoding="utf-8"))
    assert PAGE.read_text(encoding="utf-8") == page(stored)


def test_modal_frequencies_are_those_of_the_specification():
    machine = load_machine("gt2_printer")
    assert modal_frequency(machine, "x") == pytest.approx(99, abs=1)
    assert modal_frequency(machine, "y") == pytest.approx(66, abs=1)


@pytest.mark.parametrize(
    ("files", "words", "said"),
    [
        ({"a.txt": ""}, ["a.txt"], "ending '.txt', expected one of .csv"),
        ({"a.csv": "time,x\n0,0\n1,1\n"}, ["a.csv"], "no columns phi1, phi2 and no x, y"),
        ({"a.csv": "time,x,y\n0,,0\n1,1,1\n"}, ["a.csv"], "1 rows with x and y, expected"),
        ({"a.csv": "time,x,y\n0,0,0\n1,1,1\n"}, ["a.csv"], "leaves the stage"),
        ({"a.gcode": "G1 X1\n"}, ["a.gcode"], "no move in X and Y"),
        ({}, ["a.gcode"], "a.gcode: No such file or directory, expected G-code"),
        (
            {"a.csv": "time,x,y\n0,0,0\n1,.01,0\n"},
            ["a.csv", "--machine", "yin2018_dc"],
            "drive 'dc' takes no pulses, expected a stepper",
        ),
        ({"a.csv": ""}, ["a.csv", "--microsteps", "0"], "microsteps: found 0, expected"),
    ],
)
def test_mistakes_say_what_was_expected(files, words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in files.items():
        Path(name).write_text(text)
    options = {"microsteps": int(words[2])} if "--microsteps" in words else {}
    options |= {"machine": words[2]} if "--machine" in words else {}
    with pytest.raises(InputError) as caught:
        pulses(Path(words[0]), Path("o.csv"), **options)
    assert said in str(caught.value)
    assert not Path("o.csv").exists()


def test_a_path_of_positions_gives_the_pulses_of_its_angles(tmp_path):
    smooth = order()
    x = RADIUS * (smooth["phi1"] + smooth["phi2"]) / 2
    y = RADIUS * (smooth["phi1"] - smooth["phi2"]) / 2
    write_recording(Recording("p", smooth.time, {"x": x + 0.1, "y": y}), tmp_path / "path.csv")
    pulses(tmp_path / "path.csv", tmp_path / "pulses.csv", microsteps=8, centre="0.1,0")
    made, expected = read_recording(tmp_path / "pulses.csv"), staircase(smooth, Driver(8))
    assert made.metadata["pulses"] == expected.metadata["pulses"]
