"""Drawn machines with dc motors in a loop: their simulator, their files, what the package makes of
a healthy one, and cases of stepper drive as they were.
"""

import hashlib
import re
from dataclasses import replace

import numpy as np
import pytest
from strange_kit import about, exact, short_recordings

from benchmarks.shop.motions import angles
from benchmarks.strange import dc_causes, draw, files, machines, running, sizes
from corexy_fmi.effects import catalogue
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import read_recording
from corexy_fmi.simulate import simulate as package_run

NULL, SMALL = 1, 0  # seeds: nothing concealed, and a cause
SMOOTH = {"fx": 0.0, "fy": 0.0, "tf": 0.0}
MICRON = 1e-6


@pytest.fixture(scope="module")
def short():
    with short_recordings():
        yield


@pytest.fixture(scope="module")
def healthy(short):
    return draw.draw(NULL, dc=True)


@pytest.mark.parametrize("seed", [1, 4, 7])
def test_without_dry_friction_it_moves_as_the_linear_equations_do(seed):
    here = about(seed)
    machine = replace(here.machine, numbers={**here.machine.numbers, **SMOOTH})
    time, xy = here.motions[0]
    ran = running.looped(machine, 0, (time, xy), running.HEALTHY)
    ref, row = angles(xy, machine.numbers["r"]), float(time[1] - time[0])
    assert np.abs(ran.xy - exact(machine.numbers, ref, row)).max() < MICRON / 4
    assert np.abs(ran.xy - xy).max() > 30 * MICRON


def test_causes_are_the_catalogues_act_and_change_little_with_half_the_step():
    here, known = about(1), catalogue()
    runs = [running.looped(here.machine, 0, m, running.HEALTHY) for m in here.motions]
    well = max(runs, key=lambda ran: np.abs(ran.volts).max())
    motion = here.motions[[ran is well for ran in runs].index(True)]
    assert np.abs(well.volts).max() < 24
    for draws in dc_causes.DC_DRIVES[1:]:
        cause = draws(np.random.default_rng(1), here)
        assert cause.location in known[cause.name].locations
        bounds = {p.name: (p.lower, p.upper) for p in known[cause.name].parameters}
        for size in cause.bounds:
            for name, value in cause.parameters(size).items():
                assert bounds[name][0] <= value <= bounds[name][1], (cause.name, name)
        acts = cause.acts(cause.bounds[1] / 2)
        one, half = (running.looped(here.machine, 0, motion, acts, finer=k).xy for k in (1, 2))
        assert np.abs(one - half).max() < MICRON, cause.name
        assert np.abs(one - well.xy).max() > MICRON, cause.name


def test_a_loose_pulley_follows_its_rotor_within_the_play():
    here = about(0)
    backlash = dc_causes.DC_DRIVES[0](np.random.default_rng(0), here)
    motion = tuple(part[:900] for part in here.motions[0])
    tight, lost = (
        running.looped(here.machine, 0, motion, acts)
        for acts in (running.HEALTHY, backlash.acts(0.05))
    )
    reach = 0.05 * here.machine.numbers["r"]
    assert 0.05 * reach < np.abs(tight.xy - lost.xy).max() < 2 * reach


def test_a_case_is_the_same_each_time_and_the_package_reads_it(healthy, tmp_path):
    for folder, one in (("a", healthy), ("b", draw.draw(NULL, dc=True))):
        files.write(one, tmp_path / folder)
        assert files.seal(one, tmp_path / folder) == files.seal(healthy, tmp_path / "a")
    machine, n = load_machine(tmp_path / "a" / files.MACHINE), healthy.machine.numbers
    assert machine.drive == "dc"
    assert (machine.controller.kp, machine.controller.kd) == (n["kp"], n["kd"])
    for name, long in (machines.UNSURE | machines.MOTORS).items():
        assert 0.5 < machine.parameters[long] / n[name] < 2


def test_the_package_with_the_true_numbers_moves_the_same(healthy, tmp_path):
    blunt = replace(healthy.sensor, std=0.0, count=0.0, offsets=None, counts=4000)
    tables = draw._tables(0, healthy.machine, blunt, healthy.motions, running.HEALTHY)
    files.write(replace(healthy, sensor=blunt, tables=tables), tmp_path)
    names = machines.GEOMETRY | machines.UNSURE | machines.MOTORS
    true = {long: healthy.machine.numbers[name] for name, long in names.items()}
    told = load_machine(tmp_path / files.MACHINE)
    machine = replace(told, parameters={**told.parameters, **true})
    for name in files.FILES:
        recording = read_recording(tmp_path / name)
        response = package_run(machine, recording)
        for channel in ("x", "y"):
            assert np.nanmax(np.abs(response[channel] - recording[channel])) < MICRON / 4
        assert np.abs(response["V1"] - recording["V1"]).max() < 1e-3
        off = np.abs(response["phi2_meas"] - recording["phi2_meas"]).max()
        assert off == pytest.approx(np.pi / 4000, rel=0.05)


def test_a_cause_is_drawn_from_those_of_dc(short, monkeypatch):
    monkeypatch.setattr(draw, "DC_CAUSES", dc_causes.DC_DRIVES[3:])
    case = draw.draw(SMALL, dc=True)
    assert case.truth["effect"] in {"supply_saturation", "driver_deadband", "winding_lag",
                                    "torque_ripple"}  # fmt: skip
    assert case.truth["E0"] >= sizes.FAINT


def test_two_causes_beside_a_loop_are_of_different_kinds_and_both_act(short, monkeypatch):
    """A drive's own fault, which steppers do not have, is among them."""
    ripples = (sizes.KINDS[0], dc_causes.DC_DRIVES[-1:])
    monkeypatch.setattr(draw, "DC_KINDS", ripples)
    case = draw.draw(SMALL, two=True, dc=True)
    assert case.machine.dc
    assert [one.cause.name for one in case.found][1] == "torque_ripple"
    assert f"_{case.found[0].cause.name}" in {d.__name__ for d in ripples[0]}
    acts = [one.acts for one in case.found]
    whole = running.both(*acts)
    assert whole.drive == acts[1].drive != running.SOUND
    seen = [running.moved(case.machine, 0, case.motions[0], a) for a in (*acts, whole)]
    assert all(np.abs(seen[2] - one).max() > MICRON for one in seen[:2])
    assert [one["effect"] for one in case.truth["effects"]][1] == "torque_ripple"


def test_cases_of_stepper_drive_are_drawn_as_before(short):
    """Machine, sensor, file and motions of a seed by nine digits: from before there were loops."""
    case = draw.draw(1)
    told = [*case.machine.numbers.values(), case.sensor.row, case.sensor.std]
    told += [float(v) for v in re.findall(r"= ([0-9.e-]+)", case.file)]
    told += [case.tables[0][c].sum() for c in ("phi1", "phi2")]
    assert list(case.tables[0]) == ["time", "phi1", "phi2", "x", "y"]
    digest = hashlib.sha256(" ".join(f"{v:.9g}" for v in told).encode()).hexdigest()
    assert digest == "283621e2c2a9ef0ef24ea5f0db34ae3250c27489ee25c2c11000a27151e17a81"
    sums = [np.nansum(case.tables[0][c]) for c in "xy"]
    assert sums == pytest.approx([14.845939231912038, 19.81065965264111], rel=1e-9)
