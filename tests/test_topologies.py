"""Two carts on a spring, a Cartesian stage and an H-frame: closed forms, reference, FMU."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.commands.rectangle import rectangle_command
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import EffectUse, load_machine, save_machine
from corexy_fmi.machine.check import machine_from
from corexy_fmi.motion import check_kind
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import excitation, machine_vector, simulate
from corexy_fmi.topology import CARTESIAN, H_FRAME, STAGES, TWO_MASS

ROW = 1e-3
PLANAR = {
    "pulley_radius": 5e-3, "carriage_mass": 0.2, "bridge_mass": 0.5, "motor_inertia": 1e-5,
    "belt_axial_stiffness": 900.0, "bridge_pulley_spacing": 0.3, "motor_idler_span": 0.4,
}  # fmt: skip
BARE = {
    "two_mass": {
        "mass_1": 2.0, "mass_2": 0.5, "spring_stiffness": 800.0, "force_gain": 3.0,
        **{f"{kind}_friction_{n}": 0.0 for kind in ("viscous", "coulomb") for n in (1, 2)},
        "spring_damping": 0.0,
    },
    "cartesian": PLANAR | {f"{a}_{k}_friction": 0.0 for a in ("carriage", "bridge")
                           for k in ("viscous", "coulomb")},
}  # fmt: skip
BARE["h_frame"] = BARE["cartesian"] | {"clip_spacing": 0.06}


def machine(topology, drive="dc", effects=(), **parameters):
    """A frictionless machine but for what is given."""
    head = {"topology": topology, "name": topology, "drive": drive}
    document = {"machine": head, "parameters": BARE[topology] | parameters}
    return replace(machine_from(document, "test", topology), effects=tuple(effects))


def response(chosen, inputs, channels=("x", "y"), row=ROW):
    time = row * np.arange(len(next(iter(inputs.values()))))
    found = simulate(chosen, Recording("r", time, inputs))
    return time, np.array([found[c] for c in channels])


def test_two_free_carts_drift_together_and_swing_at_their_frequency():
    """A force F on cart 1: the centre of mass has F / M, the distance F / (m_1 w^2) (1 - cos)."""
    time, (x, y) = response(machine("two_mass"), {"V1": np.full(1500, 0.4)})
    centre, frequency = (2.0 * x + 0.5 * y) / 2.5, np.sqrt(800 * 2.5 / (2.0 * 0.5))
    assert np.abs(centre - 0.5 * 1.2 / 2.5 * time**2).max() < 1e-6
    swing = 1.2 / 2.0 / frequency**2 * (1 - np.cos(frequency * time))
    assert np.abs(x - y - swing).max() < 0.01 * np.abs(swing).max()


def test_the_springs_damper_takes_its_share_of_each_swing():
    """Relative motion decays with c / 2 mu."""
    chosen = machine("two_mass", spring_damping=4.0)
    time, (x, y) = response(chosen, {"V1": np.full(1500, 0.4)})
    reduced = 2.0 * 0.5 / 2.5
    decay, own = 4.0 / (2 * reduced), np.sqrt(800 / reduced)
    ringing = np.sqrt(own**2 - decay**2)
    shape = np.cos(ringing * time) + decay / ringing * np.sin(ringing * time)
    exact = 1.2 / 2.0 / own**2 * (1 - np.exp(-decay * time) * shape)
    assert np.abs(x - y - exact).max() < 0.01 * np.abs(exact).max()


def test_each_cart_brakes_by_its_own_friction():
    """The spring apart as it moves as one, both share the deceleration."""
    chosen = machine("two_mass", coulomb_friction_1=1.0, coulomb_friction_2=0.5)
    volts = np.where(np.arange(900) < 300, 4.0, 0.0)
    time, (_, _, v, w) = response(chosen, {"V1": volts}, ("x", "y", "vx", "vy"))
    speed = (2.0 * v + 0.5 * w) / 2.5
    braking = (time > 0.31) & (time < 0.85)
    slope = np.polyfit(time[braking], speed[braking], 1)[0]
    assert slope == pytest.approx(-1.5 / 2.5, rel=1e-3)


@pytest.mark.parametrize("topology", ["cartesian", "h_frame"])
def test_held_motors_leave_the_belts_stiffness(topology):
    """Static deflection of a force, and the frequency of its ringing, along each axis."""
    short = (0.3 - 0.06) / 2 + 0.4 / 2
    stiffness = {
        "cartesian": (8 / 3 * 900 / 0.3, 8 / 3 * 900 / 0.4),
        "h_frame": (2 * 900 / short, 2 * 900 / short + 4 * 900 / (3 * 0.4 + 0.3)),
    }[topology]
    for axis, (k, mass) in enumerate(zip(stiffness, (0.2, 0.7), strict=True)):
        push = EffectUse("constant_force", "xy"[axis], {"force": 2.0})
        chosen = machine(topology, "stepper", [push])
        rows = {"phi1": np.zeros(300), "phi2": np.zeros(300)}
        time, moved = response(chosen, rows)
        exact = 2.0 / k * (1 - np.cos(np.sqrt(k / mass) * time))
        assert np.abs(moved[axis] - exact).max() < 0.01 * 4.0 / k
        assert np.abs(moved[1 - axis]).max() < 1e-12


@pytest.mark.parametrize(("stage", "x", "y"), [(CARTESIAN, 3.0, -2.0), (H_FRAME, 0.5, 2.5)])
def test_no_belt_is_stretched_where_the_motors_hold_it(stage, x, y):
    held = np.array([*stage.path(1.0, 3.0, -2.0), 3.0, -2.0])
    assert held[:2] == pytest.approx([x, y])
    assert np.abs(stage.rows(1.0) @ held).max() < 1e-15


def test_the_belt_of_an_h_frame_keeps_its_length():
    assert np.abs(H_FRAME.rows(5e-3).sum(axis=0)).max() < 1e-18
    assert TWO_MASS.rows(1.0) @ np.array([1.0, 1.0, 9.0, 9.0]) == 0.0


CASES = [("two_mass", "dc"), ("cartesian", "dc"), ("cartesian", "stepper"), ("h_frame", "dc"),
         ("h_frame", "stepper")]  # fmt: skip


def lively(topology, drive, rows=120):
    """A machine with all its frictions and effects, and inputs."""
    friction = {n: 0.3 for n in BARE[topology] if "friction" in n or "damping" in n}
    effects = [EffectUse("stribeck_friction", "x", {"static_ratio": 1.6, "speed": 0.02}),
               EffectUse("constant_force", "y", {"force": 0.4})]  # fmt: skip
    chosen = machine(topology, drive, effects, **friction)
    time = ROW * np.arange(rows)
    a, b = 3 * np.sin(40 * time), 2 * np.sin(25 * time) * np.exp(-time)
    names = ("V1", "V2") if drive == "dc" else ("phi1", "phi2")
    return chosen, Recording("r.csv", time, dict(zip(names, (a, b), strict=True)))


@pytest.mark.parametrize(("topology", "drive"), CASES)
def test_reference_and_kernel_agree(topology, drive):
    chosen, order = lively(topology, drive)
    given = {"fidelity": topology, "dc": drive == "dc", "limit": 5e-5}
    channels, vector = ("x", "y", "vx", "ay", "phi1", "phi2"), machine_vector(chosen)
    drives = excitation(chosen, order)
    fast = run_lanes(bundled_layout(), drives, vector[None], channels=channels, **given)[0]
    slow = run_reference(bundled_layout(), drives, vector, channels=channels, **given)
    for name, row in zip(channels, fast, strict=True):
        assert np.allclose(row, slow[name], rtol=1e-8, atol=1e-11), name
        assert np.ptp(row) > 1e-6 or (topology, name) == ("two_mass", "phi2")


@pytest.mark.parametrize(("topology", "drive"), CASES)
def test_the_fmu_equals_the_kernel(tmp_path, topology, drive):
    chosen, order = lively(topology, drive)
    expected, found = simulate(chosen, order), run_fmu(build_fmu(tmp_path, chosen), order)
    for name in ("x", "y", "vx", "phi1_meas"):
        assert np.abs(found[name] - expected[name]).max() < 1e-12, name


@pytest.mark.parametrize("topology", sorted(BARE))
def test_its_file_reads_back(tmp_path, topology):
    chosen = machine(topology)
    save_machine(chosen, tmp_path / "machine.toml")
    back = load_machine(tmp_path / "machine.toml")
    assert replace(back, surrogate="") == replace(chosen, surrogate="")


def test_energy_is_kept_without_friction():
    """Springs and carts: the work of the motor is all there is."""
    time, (x, y, v, w) = response(
        machine("two_mass"), {"V1": np.where(np.arange(2000) < 100, 1.0, 0.0)},
        ("x", "y", "vx", "vy"),
    )  # fmt: skip
    energy = 0.5 * (2.0 * v**2 + 0.5 * w**2 + 800 * (x - y) ** 2)
    after = energy[time > 0.101]
    assert np.ptp(after) < 0.02 * after.mean()


def test_a_rectangle_on_an_h_frame_and_none_on_a_cartesian_stage():
    shape = Rectangle(0.02, 0.02, 0.05)
    chosen = machine("h_frame", "stepper", carriage_viscous_friction=20.0)
    order = rectangle_command(shape, chosen, "r.csv")
    found = simulate(chosen, order)
    assert np.abs(found["x"]).max() == pytest.approx(0.01, abs=1.5e-3)
    with pytest.raises(InputError, match="topology 'cartesian', expected 'corexy' or 'h_frame'"):
        rectangle_command(shape, machine("cartesian", "stepper"), "r.csv")
    with pytest.raises(InputError, match="expected 'corexy' here"):
        check_kind(chosen)


def test_the_kernel_and_the_tables_have_the_same_order():
    """fmu_src/native/stage.h numbers the stages by hand."""
    assert list(STAGES) == [
        "full", "reduced", "kinematic", "condensed", "single_axis", "two_mass", "cartesian",
        "h_frame",
    ]  # fmt: skip
