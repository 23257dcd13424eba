"""Drivers, windings and commutation of dc motors, against closed forms and finer steps."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from plant import machines, recording
from plant.laws import limited
from plant.machines import pack
from plant.recording import trajectory
from test_plant_more import EASY, KE, R, machine, resting, shown, slots


def test_what_a_driver_makes_of_volts():
    def given(volts, name, form, level):
        more = slots(name, "motors", {"voltage": level}, law=form)
        return limited(pack(machine(drive="dc"), "dc", more), volts)

    assert [given(v, "driver_deadband", 0.0, 0.5) for v in (-2.0, 0.4, 2.0)] == [-1.5, 0.0, 1.5]
    assert [given(v, "driver_deadband", 1.0, 0.5) for v in (-2.0, 0.4, 2.0)] == [-2.0, 0.0, 2.0]
    assert [given(v, "supply_saturation", 0.0, 3.0) for v in (-9.0, 2.0)] == [-3.0, 2.0]
    assert given(90.0, "supply_saturation", 1.0, 3.0) == pytest.approx(3.0)
    assert given(1.0, "supply_saturation", 1.0, 3.0) == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_a_winding_delays_the_torque_by_its_time_constant(form):
    """Friction holds the rotors; the torque behind the winding rises as 1 - exp(-t / tau)."""
    tau, values = 0.05, machine(drive="dc", pulley_coulomb_friction=50.0)
    run = resting(0.3)
    run.ref[1:] += 0.01
    w = pack(values, "dc", slots("winding_lag", "motors", {"time_constant": tau}, law=form))
    v = trajectory(w, run)[1]
    torque = 0.095 * 20.0 * 0.01
    assert v.shape[1] == 19
    assert v[101, 17] == pytest.approx(torque * (1.0 - np.exp(-0.1 / tau)), rel=0.02)


def test_a_short_lag_is_resolved_where_a_rotor_breaks_loose(monkeypatch):
    """There, a halt, and back: what the lag changes, and what it changes with finer steps."""
    run, lag = resting(0.1), slots("winding_lag", "motors", {"time_constant": 1e-4})
    n = np.arange(len(run.ref))
    run.ref[:] = 8.7e-3 * (np.minimum(n, 20) - np.clip(n - 60, 0, None))[:, None]
    bare, late = (shown(machine(drive="dc"), run, more, "dc")["phi1_meas"] for more in ({}, lag))
    monkeypatch.setattr(recording, "steps_per_ms", lambda w: 16 * machines.steps_per_ms(w))
    fine = shown(machine(drive="dc"), run, lag, "dc")["phi1_meas"]
    assert np.abs(late - fine).max() < 0.03 * np.abs(late - bare).max()


def test_ripple_is_a_share_of_the_torque_at_an_angle():
    """Held by a spring (the loop) against a torque: at rest the volts give what ripple takes."""
    more = slots("torque_ripple", "motors", {"ratio": 0.2, "order": 7.0, "phase": 1.0})
    push = slots(
        "periodic_disturbance", "motor1", {"amplitude": 0.02, "frequency": 0.0, "phase": np.pi / 2}
    )
    values = machine(drive="dc", **EASY)
    out = shown(values, resting(1.5), more | push, "dc")
    phi = out["phi1_meas"][-1]
    x = np.array([out["x"][-1], out["y"][-1]])
    belt = KE * R * (x.sum() - R * phi)
    torque = 0.095 * out["V1"][-1] * (1.0 + 0.2 * np.sin(7.0 * phi + 1.0))
    assert torque + 0.02 + belt == pytest.approx(0.0, abs=2e-4)
