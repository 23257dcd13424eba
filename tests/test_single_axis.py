"""The stage of one axis: closed forms, the reference, and its machine file."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import EffectUse, load_machine, machine_to_toml, save_machine
from corexy_fmi.machine.check import machine_from
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.simulate import machine_vector, simulate

ROW = 1e-3


def machine(**parameters):
    """A machine of one axis; friction is zero unless it is given."""
    numbers = {"viscous_friction": 0.0, "coulomb_friction": 0.0} | parameters
    head = {"topology": "single_axis", "name": "axis"}
    return machine_from({"machine": head, "parameters": numbers}, "test", "axis")


def response(chosen, volts, channels=("x", "vx")):
    """What voltages (n,) at 1 kHz do to it, (channels, n)."""
    time = ROW * np.arange(len(volts))
    recording = Recording("r", time, {"V1": np.asarray(volts, float)})
    found = simulate(chosen, recording)
    return time, np.array([found[c] for c in channels])


def test_a_step_of_voltage_approaches_the_balance_of_forces():
    chosen = machine(moving_mass=2.0, viscous_friction=5.0, coulomb_friction=1.5, force_gain=4.0)
    time, (x, v) = response(chosen, np.full(2000, 3.0))
    last, rate = (4.0 * 3.0 - 1.5) / 5.0, 5.0 / 2.0
    exact = last * (1 - np.exp(-rate * time))
    assert np.abs(v - exact).max() < 1e-6 * last
    assert np.abs(x - (last * time - exact / rate)).max() < 1e-6


def test_coulomb_friction_brakes_it_evenly_and_holds_it():
    chosen = machine(moving_mass=2.0, coulomb_friction=1.5, force_gain=4.0)
    time, (_, v) = response(chosen, np.where(np.arange(2000) < 100, 2.0, 0.0))
    top = (8.0 - 1.5) / 2.0 * 0.1
    stop = 0.1 + top / (1.5 / 2.0)
    braking = (time > 0.1) & (time < stop - ROW)
    assert np.abs(v - (top - 0.75 * (time - 0.1)))[braking].max() < 1e-9
    assert stop < time[-1]
    assert np.all(v[time > stop + ROW] == 0.0)


def test_it_sticks_below_the_bound():
    _, (x, _) = response(machine(coulomb_friction=1.0), np.full(200, 0.999))
    assert np.all(x == 0.0)


def test_a_loop_without_damping_rings_at_its_frequency():
    chosen, rows = machine(moving_mass=2.0, force_gain=4.0), 20000
    time = 1e-5 * np.arange(rows)
    drive = Excitation(
        time, np.r_[0.0, np.full(rows - 1, 0.01)], np.zeros(rows), "closed_loop", kp=5000.0
    )
    vector = machine_vector(chosen)[None]
    x = run_lanes(bundled_layout(), drive, vector, fidelity="single_axis", dc=True)[0, 0]
    exact = 0.01 * (1 - np.cos(np.sqrt(4.0 * 5000.0 / 2.0) * (time - 1e-5)))
    assert (
        np.abs(x - exact)[1:].max() < 0.02 * 0.01
    )  # held for 10 us: anti-damped by 0.1 % a radian


@pytest.mark.parametrize("weight", [0.0, 0.4, 1.0])
def test_the_loop_damps_what_its_weight_says(weight):
    """A ramp's steady lag: Fv v / (g kp) + kd (1 - weight) v / kp."""
    chosen = machine(moving_mass=1.0, viscous_friction=30.0, force_gain=2.0)
    text = f"pd kp=4000.0 kd=20.0 rate_weight={weight}"
    time = ROW * np.arange(1500)
    ramp = Recording("r", time, {"phi1": 0.1 * time}, {"controller": text})
    lag = 0.1 * time[-1] - simulate(chosen, ramp)["x"][-1]
    exact = 0.1 * (30.0 / 2.0 + 20.0 * (1 - weight)) / 4000.0
    assert abs(lag - exact) < 0.1 * ROW * 0.51 + 1e-9  # the loop holds its voltage for a row


EFFECTS = (
    ("constant_force", "x", {"force": 3.0}),
    ("stribeck_friction", "x", {"static_ratio": 1.8, "speed": 0.01}),
    ("winding_lag", "motors", {"time_constant": 3e-3}),
    ("periodic_disturbance", "x", {"amplitude": 2.0, "frequency": 9.0, "phase": 0.3}),
    ("sensor_delay", "sensor", {"delay": 4e-3}),
)


@pytest.mark.parametrize("effect", [None, *EFFECTS])
@pytest.mark.parametrize("mode", ["voltages", "closed_loop"])
def test_reference_and_kernel_agree(mode, effect):
    chosen = machine(viscous_friction=3.0, coulomb_friction=0.4, pulley_radius=0.2)
    uses = (EffectUse(*effect),) if effect else ()
    vector = machine_vector(replace(chosen, effects=uses))
    time = ROW * np.arange(120)
    drive = Excitation(
        time, 5 * np.sin(40 * time), 0 * time, mode, kp=90.0, kd=4.0, rate_weight=0.3
    )
    given = {"fidelity": "single_axis", "dc": True, "limit": 1e-4}
    channels = ("x", "y", "vx", "ax", "phi1", "phi2", "V1")
    fast = run_lanes(bundled_layout(), drive, vector[None], channels=channels, **given)[0]
    slow = run_reference(bundled_layout(), drive, vector, channels=channels, **given)
    for name, row in zip(channels, fast, strict=True):
        assert np.allclose(row, slow[name], rtol=1e-9, atol=1e-12), name
    assert np.ptp(fast[0]) > 1e-3
    assert np.all(fast[1] == 0)


def test_the_file_reads_back_and_its_recording_has_one_motor(tmp_path):
    chosen = machine(moving_mass=95.0)
    save_machine(chosen, tmp_path / "machine.toml")
    assert load_machine(tmp_path / "machine.toml") == replace(
        chosen, surrogate=load_machine(tmp_path / "machine.toml").surrogate
    )
    assert "carriage_mass" not in machine_to_toml(chosen)
    given = Recording(
        "r", ROW * np.arange(9.0), {"V1": np.ones(9), "x": np.zeros(9)}, {"motors": "1"}
    )
    write_recording(given, tmp_path / "r.csv")
    assert simulate(chosen, read_recording(tmp_path / "r.csv"))["x"][-1] > 0


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"machine": {"topology": "single_axis", "drive": "stepper"}}, "drive: found 'stepper'"),
        ({"machine": {"topology": "single_axis", "fidelity": "reduced"}}, "fidelity: found"),
        ({"machine": {"topology": "singleaxis"}}, "'single_axis'"),
        ({"parameters": {"carriage_mass": 1.0}}, "unknown parameter 'carriage_mass'"),
        ({"effects": [{"name": "belt_slack", "location": "belts"}]}, "topology 'single_axis'"),
        ({"effects": [{"name": "constant_force", "location": "y"}]}, "expected one of 'x'"),
    ],
)
def test_what_it_does_not_know_is_refused(change, told):
    with pytest.raises(InputError, match=told):
        machine_from({"machine": {"topology": "single_axis"}} | change, "test", "axis")


@pytest.mark.parametrize("flavour", ["native", "python"])
@pytest.mark.parametrize("loop", [True, False])
def test_its_fmu_equals_the_kernel(tmp_path, flavour, loop):
    chosen = replace(
        machine(moving_mass=4.0, viscous_friction=20.0, coulomb_friction=2.0, force_gain=3.0),
        effects=(EffectUse("constant_force", "x", {"force": 1.5}),),
    )
    time = ROW * np.arange(200)
    given = {"phi1": 0.01 * np.sin(20 * time)} if loop else {"V1": 3 * np.cos(30 * time)}
    told = {"motors": "1"} | ({"controller": "pd kp=900.0 kd=9.0 rate_weight=0.0"} if loop else {})
    order = Recording("order.csv", time, given, told)
    expected, found = simulate(chosen, order), run_fmu(build_fmu(tmp_path, chosen, flavour), order)
    assert np.ptp(expected["x"]) > 1e-3
    for name in ("x", "vx", "phi1_meas"):
        assert np.abs(found[name] - expected[name]).max() < 1e-12, name
