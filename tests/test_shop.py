"""Recordings of a workshop: their simulator, their sensors, the table of cases."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.shop import case as cases_of
from benchmarks.shop import motions, sensors, simulator, stage
from benchmarks.shop.cases import CASES
from corexy_fmi.effects import catalogue
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import read_recording
from corexy_fmi.simulate import simulate as package_run

FOLDER = Path(simulator.__file__).parent
MACHINES = {"yin2018": stage.YIN2018, "light_bench": stage.LIGHT_BENCH}
SMOOTH = {"fx": 0.0, "fy": 0.0, "tf": 0.0}
UNDAMPED = SMOOTH | {"bx": 0.0, "by": 0.0, "Bp": 0.0}
SHORT = ("oneway_asym", "slow_stribeck", "shaper")
SYMBOLS = {
    "pulley_radius": "r", "carriage_mass": "mx", "bridge_mass": "my", "pulley_mass": "mp",
    "pulley_inertia": "Jp", "belt_axial_stiffness": "AE", "bridge_pulley_spacing": "W",
    "motor_idler_span": "H", "clip_spacing": "c", "carriage_viscous_friction": "bx",
    "bridge_viscous_friction": "by", "carriage_coulomb_friction": "fx",
    "bridge_coulomb_friction": "fy", "pulley_viscous_friction": "Bp",
    "pulley_coulomb_friction": "tf",
}  # fmt: skip


def small():
    time, xy = motions.path([(0, 0), (0.02, 0), (0.02, 0.015), (0, 0)], 0.06)
    return time, motions.angles(xy), xy


@pytest.mark.parametrize("name", MACHINES)
def test_the_numbers_are_those_of_the_machine_file(name):
    of = load_machine(name).parameters
    assert {symbol: of[long] for long, symbol in SYMBOLS.items()} == MACHINES[name]


def test_at_rest_no_section_is_stretched():
    q = stage.at_rest(np.array([1.7, -0.4]), 5e-3)
    assert q[:2] == pytest.approx([5e-3 * 0.65, 5e-3 * 1.05])  # (1)
    assert np.abs(stage.table(5e-3) @ q).max() < 1e-17


def test_a_motion_without_dry_friction_ends_where_the_kinematics_say():
    time, phi, xy = small()
    q, _ = simulator.simulate(time, phi, stage.YIN2018 | SMOOTH)
    assert np.abs(q[:, :2] - xy).max() > 1e-4
    assert q[-1, :2] == pytest.approx(xy[-1], abs=1e-7)


@pytest.mark.parametrize(
    ("name", "faults"),
    [
        ("yin2018", stage.Faults()),
        ("light_bench", stage.Faults()),
        ("light_bench", stage.Faults(breakaway=(1.5, 1.8), fades=4e-3)),
        ("light_bench", stage.Faults(play=(0.012, 0.02))),
    ],
)
def test_half_the_step_changes_less_than_half_a_micron(name, faults):
    time, phi, _ = small()
    one, half = (
        simulator.simulate(time, phi, MACHINES[name], faults, step=h)[0]
        for h in (simulator.STEP, simulator.STEP / 2)
    )
    assert np.abs(one - half)[:, :2].max() < 5e-7


@pytest.mark.parametrize("friction", [UNDAMPED, SMOOTH, {}])
def test_energy_does_not_grow_without_input(friction):
    numbers = stage.LIGHT_BENCH | friction
    time, first = np.arange(400) * 1e-3, np.zeros(12)
    first[:2] = 1e-3, -5e-4
    states = simulator.simulate(time, np.zeros((400, 2)), numbers, begin=first)
    energy = simulator.energy(*states, stage.stage(numbers, stage.Faults()))
    assert energy.max() < 1.002 * energy[0]  # the step's own error
    kept = energy[-20:].mean() / energy[0]
    assert kept == pytest.approx(1.0, abs=2e-3) if friction is UNDAMPED else kept < 0.5


def test_dry_friction_holds_what_is_weaker_exactly():
    time, still = np.arange(200) * 1e-3, np.zeros((200, 2))
    for force, moves in ((0.19, False), (0.6, True)):
        push = stage.Faults(push=np.full((200, 2), [force, 0.0]))
        q, _ = simulator.simulate(time, still, stage.YIN2018, push)
        assert q[:, 0].any() == moves


def test_play_lets_the_stage_wait_where_a_motor_turns_back():
    time, xy = motions.path([(0, 0), (0.02, 0.02), (0, 0)], 0.04)
    loose = stage.Faults(play=(0.03, -1.0))
    tight, lost = (
        simulator.simulate(time, motions.angles(xy), stage.YIN2018, f)[0] for f in (None, loose)
    )
    behind = tight[:, 2] - lost[:, 2]
    assert 0.015 < behind.max() < 0.022  # half the play, and what the contact gives
    assert -0.022 < behind.min() < -0.015
    assert np.array_equal(tight[:, 3], lost[:, 3])


@pytest.mark.parametrize("name", MACHINES)
def test_the_package_moves_the_same(name, tmp_path):
    time, phi, _ = small()
    run = cases_of.Run(time, phi, simulator.simulate(time, phi, MACHINES[name])[0][:, :2])
    case = cases_of.Case("same", name, "", cases_of.nothing(), lambda: [run] * 3, noise=0.0)
    cases_of.write(case, tmp_path)
    recording = read_recording(tmp_path / "train1.csv")
    response = package_run(load_machine(name), recording)
    for channel in ("x", "y"):
        assert np.abs(response[channel] - recording[channel]).max() < 1e-6


def test_nothing_that_makes_recordings_is_shared():
    makers = ["stage", "simulator", "motions", "sensors", "case", "cases",
              "stage_cases", "log_cases", "sensor_cases"]  # fmt: skip
    for name in makers:
        for node in ast.walk(ast.parse((FOLDER / f"{name}.py").read_text(encoding="utf-8"))):
            named = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            named += [a.name for a in node.names] if isinstance(node, ast.Import) else []
            for module in named:
                assert not re.match(r"corexy_fmi|plant|benchmarks(?!\.shop)", module), (
                    name,
                    module,
                )


def test_every_case_names_what_there_is():
    known, places = catalogue(), {"sensor", "frame", "tool", "bridge", "belts", "xy"}
    places |= {place for effect in known.values() for place in effect.locations}
    words = {"explained", "ambiguous", "unexplained", "nothing_missing"}
    for name, case in CASES.items():
        assert name == case.name
        assert case.machine in cases_of.NUMBERS
        assert case.truth.allowed <= words
        assert case.truth.places <= places
        assert bool(case.truth.causes) == ("explained" in case.truth.allowed)
        for effect, place in (pair for cause in case.truth.causes for pair in cause):
            assert place in known[effect].locations
    different = {case.done + case.machine for case in CASES.values()}
    assert len(different) == len(CASES) >= 55


@pytest.mark.parametrize("name", SHORT)
def test_a_case_writes_recordings_that_can_be_read(name, tmp_path):
    cases_of.write(CASES[name], tmp_path)
    for file in cases_of.TRAIN + cases_of.HOLDOUT:
        recording = read_recording(tmp_path / file)
        assert {"phi1", "phi2", "x", "y"} <= set(recording.channels)
        assert all(np.isfinite(values).all() for values in recording.channels.values())
        assert np.ptp(recording["x"]) > 0.01


def test_a_case_is_the_same_each_time_but_for_what_is_left_out():
    case = CASES["oneway_asym"]
    whole, part = (cases_of.recorded(c)[0] for c in (case, replace(case, every=8, columns="x")))
    assert "y" not in part
    seen = np.isfinite(part["x"])
    assert np.flatnonzero(seen).tolist() == list(range(0, len(seen), 8))
    assert np.array_equal(part["x"][seen], whole["x"][seen])


def test_sensors_do_what_they_say():
    time, random = np.arange(1000) / 500, np.random.default_rng(0)
    xy = np.column_stack([np.sin(2 * np.pi * 2 * time), np.cos(2 * np.pi * 2 * time)])
    late = sensors.late((0.01, 0.0, 0.0))(0, time, xy, random)
    assert np.allclose(late[5:], xy[:-5], atol=1e-9)
    assert len(np.unique(sensors.held(10)(0, time, xy, random)[:100, 0])) == 10
    smooth, lagging = (
        sensors.low_pass(15.0, both_ways=both)(0, time, xy, random)[200:-200] for both in (1, 0)
    )
    assert np.abs(smooth - xy[200:-200]).max() < 0.01 < np.abs(lagging - xy[200:-200]).max()
    loose = sensors.loose_x(0.2)(0, time, xy, random)
    assert np.abs(loose - xy).max(axis=0) == pytest.approx([0.1, 0.0])
    counts = sensors.rounded(0.5, 0.0)(0, time, xy, random)
    assert set(np.unique(counts)) == {-1.0, -0.5, 0.0, 0.5, 1.0}
