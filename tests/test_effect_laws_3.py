"""The closed form or limit that each effect of motors, structure and sensor must meet."""

import numpy as np
import pytest
from kernel_helpers import (
    DAMPED,
    QUIET,
    STIFFNESS,
    angles_of,
    at_rest,
    drive,
    lively,
    parameters,
    polyline,
    run,
    still,
    vector,
)

from corexy_fmi.effects import microstep_error, tooth_ripple
from corexy_fmi.topology import FULL, REDUCED

R, STEP_ANGLE = 5e-3, 2 * np.pi / 200


# motors


@pytest.mark.parametrize("name", ["tooth_ripple", "microstep_error"])
@pytest.mark.parametrize(("motor", "sign"), [("motor1", 1), ("motor2", -1)])
def test_ripples_have_their_amplitude_and_period(name, motor, sign):
    """Half of a motor's error goes to x, half to y: r a w(50 phi + p), a sin(z phi + p)."""
    time, path = polyline([(0, 0), (0.05, 0.02)], 0.05)
    angle = angles_of(path)[:, 0 if sign > 0 else 1]
    numbers = (2e-5, 0.6, 17.0) if name == "tooth_ripple" else (4e-3, 0.6, 0.2, -0.3)
    error = 2e-5 * (np.sin(17 * angle + 0.6) - np.sin(0.6))
    if name == "microstep_error":
        wave = [
            np.sin(t) + 0.2 * np.sin(4 * t) - 0.3 * np.cos(4 * t) for t in (50 * angle + 0.6, 0.6)
        ]
        error = R * 4e-3 * (wave[0] - wave[1])
    x, y = run(drive(time, path), vector(effects=[(name, motor, numbers)]), fidelity="kinematic")
    assert x - path[:, 0] == pytest.approx(error / 2, abs=1e-12)
    assert y - path[:, 1] == pytest.approx(sign * error / 2, abs=1e-12)


@pytest.mark.parametrize("name", ["tooth_ripple", "microstep_error"])
def test_ripples_slopes_are_those_of_what_they_add(name):
    """What is told of the rate (or of the travel for an angle) is the derivative."""
    if name == "tooth_ripple":
        made, key, slope = tooth_ripple.mesh, "travel", "gain"
        numbers = (2e-5, 0.6, 17.0, 0.3, -0.4)
        ends = [made(0.0, 0.0, at, *numbers)[key] for at in (0.7 - 1e-6, 0.7 + 1e-6)]
        told = made(0.0, 0.0, 0.7, *numbers)[slope]
    else:
        made, numbers = microstep_error.microstep, (4e-3, 0.6, 0.3, -0.4)
        ends = [made(at, 1.0, *numbers)["command"] for at in (0.7 - 1e-6, 0.7 + 1e-6)]
        told = made(0.7, 1.0, *numbers)["rate"]
    assert told == pytest.approx((ends[1] - ends[0]) / 2e-6, rel=1e-6)


def test_ripples_turn_the_belts_with_their_slope():
    """What the belts feel is the gradient of their energy: they rest where the kinematics say."""
    time, path = polyline([(0, 0), (4e-3, 1e-3)], 2e-2, rest=1.0)
    effects = [("tooth_ripple", "motors", (5e-5, 0.3, 16.0))]
    end = run(drive(time, path), vector(effects=effects, **DAMPED))[:, -1]
    ideal = run(drive(time, path), vector(effects=effects), fidelity="kinematic")[:, -1]
    assert end == pytest.approx(ideal, abs=1e-9)
    assert np.abs(end - path[-1]).max() > 1e-5


@pytest.mark.parametrize("fidelity", ["full", "kinematic"])
@pytest.mark.parametrize("steps", [-3, 4])
def test_missed_steps_jump_by_exactly_so_many(steps, fidelity):
    """r n 2 pi / 200 of belt travel from that time on, half of it in x and half in y."""
    time, path = polyline([(0, 0), (0.01, 0)], 0.02, rest=1.0)
    values = vector(effects=[("missed_steps", "motor1", (steps, 0.25, 2e-3))], **DAMPED)
    jump = run(drive(time, path), values, fidelity=fidelity)
    jump -= run(drive(time, path), vector(**DAMPED), fidelity=fidelity)
    assert np.abs(jump[:, time < 0.25]).max() == 0.0
    assert jump[:, -1] == pytest.approx(R * steps * STEP_ANGLE / 2, rel=1e-4)


def test_missed_steps_are_lost_over_their_duration():
    """x = r n (2 pi / 200) (3 p^2 - 2 p^3) / 2, p = (t - t_0) / T while the rotor slips."""
    time, path = polyline([(0, 0), (0, 0)], 0.02, rest=0.5)
    effects = [("missed_steps", "motor1", (3.0, 0.1, 0.05))]
    jump = run(drive(time, path), vector(effects=effects), fidelity="kinematic")
    share = np.clip((time - 0.1) / 0.05, 0.0, 1.0)
    assert jump[0] == pytest.approx(R * 3 * STEP_ANGLE / 2 * share**2 * (3 - 2 * share), abs=1e-12)


def test_detents_hold_a_stepper_off_its_command():
    """T_h sin(50 d) = -T_d sin(200 (phi_c + d) + phase) at rest, in both motors."""
    torque, phase, holding = 0.02, 0.8, 0.3
    effects = [("detent_torque", "motors", (torque, phase, 200.0, holding, 5e-3))]
    phi1, phi2 = at_rest(effects, channels=("phi1", "phi2"))
    balance = holding * np.sin(50 * phi1) + torque * np.sin(200 * phi1 + phase)
    assert phi1 == phi2 != 0
    assert balance == pytest.approx(0, abs=1e-9)


def test_a_stepper_with_detents_begins_at_rest():
    """Where field and detents balance: nothing moves until it is told to, but by 2 % of the way."""
    effects = [("detent_torque", "motors", (0.02, 0.8, 200.0, 0.3, 1e-4))]
    given = still(200, 1e-3, (0.1, 0.1), "angles")
    names = ("phi1", "phi2", "x", "y")
    phi1, phi2, x, y = run(given, vector(effects=effects, **DAMPED), channels=names, limit=2e-5)
    aside = phi1[0] - 0.1
    assert abs(aside) > 5e-4
    assert phi1[0] == phi2[0]
    assert np.abs(phi1 - phi1[0]).max() < 0.02 * abs(aside)
    assert np.abs(x - R * phi1[0]).max() < 0.02 * R * abs(aside)
    assert np.abs(y).max() < 1e-9


def held(effects, volts, channels, rows=60, **nominal):
    """A dc run with rotors so heavy that they do not turn."""
    light = {"motor_inertia": 1.0, "pulley_coulomb_friction": 0.0, **nominal}
    values = vector("yin2018_dc", effects, **light)
    given = still(rows, 5e-4, volts, "voltages")
    return given.time, run(given, values, dc=True, channels=channels)


def test_the_current_rises_with_the_windings_time_constant():
    """A voltage step on a held rotor: tau = K_1 V (1 - exp(-t / T)); told is a step's mean."""
    gain = parameters("yin2018_dc")["motor_torque_gain"]
    time, (torque, speed) = held(
        [("winding_lag", "motors", (4e-3,))], (6.0, 0.0), ("torque1", "omega1")
    )
    back = parameters("yin2018_dc")["motor_damping_gain"] * speed
    expected = gain * 6.0 * (1 - np.exp(-time / 4e-3))
    assert np.abs(torque + back - expected)[1:].max() < 0.03 * gain * 6.0


@pytest.mark.parametrize(
    ("name", "limit", "given", "reached"),
    [
        ("driver_deadband", 1.5, 5.0, 3.5),
        ("driver_deadband", 1.5, -5.0, -3.5),
        ("driver_deadband", 1.5, 1.0, 0.0),
        ("supply_saturation", 4.0, 5.0, 4.0),
        ("supply_saturation", 4.0, -5.0, -4.0),
        ("supply_saturation", 4.0, 3.0, 3.0),
    ],
)
def test_the_driver_gives_what_it_can(name, limit, given, reached):
    _, (torque,) = held([(name, "motors", (limit,))], (given, 0.0), ("torque1",), rows=3)
    gain = parameters("yin2018_dc")["motor_torque_gain"]
    assert torque[1:] == pytest.approx(gain * reached, rel=1e-3, abs=1e-5)


def test_a_soft_supply_gives_way_before_its_limit():
    """V / (1 + r^8)^(1/8): a twelfth is missing at the limit, nothing far above it."""
    gain = parameters("yin2018_dc")["motor_torque_gain"]
    for given, reached in ((4.0, 4.0 / 2**0.125), (40.0, 4.0), (1e5, 4.0), (1.0, 1.0)):
        _, (torque,) = held(
            [("supply_saturation", "motors", (4.0, 1.0))], (given, 0.0), ("torque1",), rows=3
        )
        assert torque[1:] == pytest.approx(gain * reached, rel=1e-3)


@pytest.mark.parametrize("share", [1.0, 0.3, 0.0])
def test_commutation_ripples_with_the_angle(share):
    """tau = K_1 V - K_2 omega + (K_1 V - share K_2 omega) ratio sin(order phi + phase)."""
    ratio, order, phase, p = 0.3, 7.0, 0.5, parameters("yin2018_dc")
    values = vector("yin2018_dc", [("torque_ripple", "motors", (ratio, order, phase, share))])
    given = still(400, 2.5e-4, (3.0, 3.0), "voltages")
    names = ("torque1", "phi1", "omega1")
    torque, phi, omega = run(given, values, dc=True, channels=names, limit=2e-5)
    driven, taken = p["motor_torque_gain"] * 3.0, p["motor_damping_gain"] * omega
    whole = driven - taken
    expected = whole + (driven - share * taken) * ratio * np.sin(order * phi + phase)
    assert np.ptp(phi) > 2 * np.pi / order
    assert np.abs(torque - expected)[5:].max() < 5e-3 * whole.max()


def test_a_torque_in_time_turns_a_free_rotor():
    """Held by nothing but inertia: omega = a (1 - cos(2 pi f t)) / (2 pi f J)."""
    size, frequency = 0.02, 20.0
    effects = [("periodic_disturbance", "motor1", (size, frequency, 0.0))]
    time, (speed,) = held(effects, (0.0, 0.0), ("omega1",), rows=200, motor_damping_gain=0.0)
    omega = 2 * np.pi * frequency
    expected = size * (1 - np.cos(omega * time)) / (omega * 1.0)
    assert np.abs(speed - expected).max() < 0.02 * expected.max()


# structure


def test_racking_stands_askew_by_the_couple_of_the_belts():
    """K theta = (W / 2) (F_right - F_left) at rest, and y_out = y + theta x."""
    stiffness, where, force = 60.0, 0.03, 4.0
    angles = angles_of(np.array([[where, 0.0]]))[0]
    given = still(6000, volts=angles)
    effects = [("racking", "bridge", (stiffness, 1e-3, 0.5)), ("constant_force", "x", (force,))]
    names = ("x", "y", "y_true", *(f"tension{i}" for i in (2, 5, 8, 11)))
    values = vector(effects=effects, **DAMPED)
    x, y, y_true, left1, right1, right2, left2 = run(given, values, channels=names)[:, -1]
    couple = parameters()["bridge_pulley_spacing"] / 2
    couple *= (right1 - right2) - (left2 - left1)
    theta = (y - y_true) / x
    assert abs(theta) > 1e-3
    assert theta == pytest.approx(couple / stiffness, rel=1e-4)


def test_racking_pulls_both_ends_by_its_yaw():
    """The belts' energy with the ends of the bridge moved by +-theta W / 2 is least at rest."""
    stiffness, force, p = 60.0, 4.0, parameters()
    effects = [("racking", "bridge", (stiffness, 1e-3, 0.5)), ("constant_force", "x", (force,))]
    x, y = at_rest(effects, rows=6000, channels=("x", "y_true"))
    rows = np.column_stack([FULL.rows(R), np.zeros(12)])
    half = p["bridge_pulley_spacing"] / 2
    for section, end, weight in ((1, -1, 1), (7, 1, 1), (4, 1, -1), (10, -1, -1)):
        rows[section, 12] = end * half * weight
    k = np.array(FULL.constants(p, 0.0).stiffness)
    free = np.array([0, 1, *range(4, 13)])
    matrix = rows[:, free].T @ (k[:, None] * rows[:, free])
    matrix[-1, -1] += stiffness
    load = np.zeros(len(free))
    load[0] = force
    rest = np.linalg.solve(matrix, load)
    assert [x, y] == pytest.approx(rest[:2], rel=1e-5, abs=1e-9)


def periods(time, values):
    """Mean period [s] between upward crossings of zero."""
    up = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    part = values[up] / (values[up] - values[up + 1])
    return np.diff(time[up] + part * (time[1] - time[0])).mean()


def test_the_frame_rings_with_the_stage_on_it():
    """w_f / sqrt(1 + m / m_f) where belts and friction hold the axis; felt in ax, not in x."""
    mass, frequency, p = 0.5, 12.0, parameters("gt2_printer")
    held_fast = {"carriage_coulomb_friction": 500.0}
    effects = [("frame_mode", "frame", (mass, frequency, 1e-3)), ("constant_force", "y", (5.0,))]
    light = {**QUIET, **held_fast, "belt_damping_time": 1e-4}
    values = vector("gt2_printer", effects, **light)
    given = still(3000)
    ax, ay, y = run(given, values, channels=("ax", "ay", "y"))
    moving = FULL.constants(p, 0.0).mass[1]
    assert np.abs(ax).max() == 0.0
    late = given.time > 1.0
    found = 1 / periods(given.time[late], ay[late])
    assert found == pytest.approx(frequency / np.sqrt(1 + moving / mass), rel=0.01)
    assert np.ptp(y[late]) < 0.05 * np.abs(ay[late]).max() / (2 * np.pi * found) ** 2


def test_the_frame_and_the_axis_swing_as_two_masses():
    """Without friction: (m, m; m, m + m_f) (q'', u'') + diag(K, m_f w^2) (q, u) = (F, 0)."""
    mass, frequency, force = 1.5, 9.0, 5.0
    effects = [("frame_mode", "frame", (mass, frequency, 1e-6)), ("constant_force", "x", (force,))]
    light = {**QUIET, "carriage_viscous_friction": 0.0}
    given, options = still(800), {"fidelity": "reduced", "channels": ("x", "ax"), "limit": 1e-5}
    x, ax = run(given, vector(effects=effects, **light), **options)
    moving = REDUCED.constants({**parameters(), **light}, 0.0).mass[0]
    inertia = np.array([[moving, moving], [moving, moving + mass]])
    springs = np.diag([STIFFNESS, mass * (2 * np.pi * frequency) ** 2])
    squares, shapes = np.linalg.eig(np.linalg.solve(inertia, springs))
    rest = np.linalg.solve(springs, [force, 0.0])
    shares = np.linalg.solve(shapes, rest)
    waves = np.cos(np.sqrt(squares)[:, None] * given.time) * shares[:, None]
    path, swing = rest[:, None] - shapes @ waves, shapes @ (squares[:, None] * waves)
    assert np.abs(x - path[0]).max() < 0.01 * np.ptp(x)
    assert np.abs(ax - swing.sum(axis=0))[1:].max() < 0.02 * np.ptp(ax)


# sensor


@pytest.mark.parametrize("lag", [2e-4, 3e-3, 0.03])
@pytest.mark.parametrize("fidelity", ["full", "kinematic"])
def test_a_lagging_sensor_follows_its_equation(lag, fidelity):
    """Behind a ramp x_m = v (t - T (1 - exp(-t / T))), for any step."""
    time = np.arange(300) * 1e-3
    given = drive(time, np.column_stack([0.05 * time, 0 * time]))
    values = vector(effects=[("sensor_lag", "sensor", (lag,))])
    x, true = run(given, values, fidelity=fidelity, channels=("x", "x_true"))
    if fidelity == "kinematic":
        assert x == pytest.approx(0.05 * (time - lag * (1 - np.exp(-time / lag))), abs=1e-12)
    assert true[-1] - x[-1] == pytest.approx(0.05 * lag * (1 - np.exp(-0.299 / lag)), rel=2e-2)


def test_a_turned_and_a_scaled_sensor():
    names = ("x", "y", "ax", "ay")
    x, y, ax, ay = run(drive(*lively()), vector(), channels=names)
    turned = vector(effects=[("sensor_rotation", "sensor", (0.01,))])
    found = run(drive(*lively()), turned, channels=names)
    a = 0.01
    expected = np.array([x - a * y, y + a * x, ax - a * ay, ay + a * ax])
    assert found == pytest.approx(expected, abs=1e-15)
    for sizes in ((1.02, 1.0), (1.0, 0.97), (1.02, 0.97)):
        scaled = vector(effects=[("sensor_scale", "sensor", sizes)])
        found = run(drive(*lively()), scaled, channels=names)
        expected = np.array([x * sizes[0], y * sizes[1], ax * sizes[0], ay * sizes[1]])
        assert found == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("ratio", [-0.02, 0.02])
@pytest.mark.parametrize("begun", [0.0, 100.0])
def test_a_wrong_clock_stretches_time(ratio, begun):
    """A stamp t was taken at t (1 + ratio): the channels of the sensor, not of the encoders."""
    time, path = lively(400)
    values = vector(effects=[("clock_drift", "sensor", (ratio,))])
    names = ("x", "y", "phi1", "x_true")
    seen = run(drive(time + begun, path), values, channels=names, limit=5e-5)
    fine = np.arange(0, time[-1], 5e-5)
    dense = np.column_stack([np.interp(fine, time, column) for column in path.T])
    exact = run(drive(fine, dense), vector(), limit=5e-5)
    at = time * (1 + ratio)
    inside = at < time[-1]
    for found, true in zip(seen[:2], exact, strict=True):
        assert np.abs(found - np.interp(at, fine, true))[inside].max() < 2e-6
    bare = run(drive(time, path), vector(), channels=names, limit=5e-5)
    assert seen[2:] == pytest.approx(bare[2:], abs=1e-9)
    assert np.abs(seen[0] - bare[0]).max() > 1e-4
