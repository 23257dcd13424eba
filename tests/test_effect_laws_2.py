"""The closed form or limit that each effect of belts, motors, structure and sensor must meet."""

import numpy as np
import pytest
from kernel_helpers import (
    FRICTIONLESS,
    Probe,
    angles_of,
    drive,
    lively,
    parameters,
    polyline,
    run,
    vector,
)

from corexy_fmi.kernel.call import Excitation
from corexy_fmi.topology import FULL, REDUCED
from corexy_fmi.topology.corexy import equivalent_stiffness

R, STEP_ANGLE = 5e-3, 2 * np.pi / 200
STIFFNESS = 2 * equivalent_stiffness(parameters())  # [N/m] of the stage along x and along y
QUIET = {n: 0.0 for n in parameters() if n.endswith("friction")}
DAMPED = {**FRICTIONLESS, "belt_damping_time": 1e-3}


def still(rows=3000, step=1e-3, volts=(0.0, 0.0), mode="angles"):
    """Inputs that do not change."""
    return Excitation(np.arange(rows) * step, *(np.full(rows, v) for v in volts), mode)


def at_rest(effects, rows=3000, channels=("x", "y"), fidelity="full", **nominal):
    """The last row of a run with motors held at zero."""
    values = vector(effects=effects, **(nominal or DAMPED))
    return run(still(rows), values, channels=channels, fidelity=fidelity)[:, -1]


def slide_at(speed, effects, fidelity="reduced", length=0.06):
    """Lag [m] behind a steady move along x."""
    time, path = polyline([(0, 0), (length, 0)], speed)
    x = run(drive(time, path), vector(effects=effects), fidelity=fidelity)[0]
    return path[-1, 0] - x[-1]


# guides


@pytest.mark.parametrize("stiffness", [3e3, 3e4])
def test_bristles_bend_by_dahls_curve(stiffness):
    """A slow pull: K (x_c - x) = f (1 - exp(-s x / f)) + b v, f the Coulomb friction."""
    c, speed = REDUCED.constants(parameters(), 0.0), 1e-4
    time, path = polyline([(0, 0), (3e-4, 0)], speed)
    values = vector(effects=[("presliding_hysteresis", "x", (stiffness,))])
    x = run(drive(time, path), values, fidelity="reduced")[0]
    friction = c.coulomb[0] * (1 - np.exp(-stiffness * x / c.coulomb[0]))
    moving = np.gradient(x, time) * c.viscous[0]
    belts = STIFFNESS * (path[:, 0] - x)
    assert np.abs(belts - friction - moving)[50:].max() < 2e-3 * c.coulomb[0]
    assert friction.max() > 0.5 * c.coulomb[0]


def test_stiff_bristles_are_coulomb_friction():
    time, path = polyline([(0, 0), (0.01, 0), (0, 0)], 0.02, rest=0.1)
    bare = run(drive(time, path), vector())
    found = run(drive(time, path), vector(effects=[("presliding_hysteresis", "xy", (1e7,))]))
    assert np.abs(found - bare).max() < 3e-7


@pytest.mark.parametrize("place", [0.0, 0.01, 0.03])
def test_a_tight_spot_adds_its_bell(place):
    """Steady sliding past: K lag = b v + f + extra exp(-(x - c)^2 / 2 w^2)."""
    c, speed, extra, width = REDUCED.constants(parameters(), 0.0), 0.005, 2.0, 0.01
    time, path = polyline([(-0.04, 0), (0.04, 0)], speed)
    effects = [("friction_vs_position", "x", (extra, place, width))]
    x = run(drive(time, path), vector(effects=effects), fidelity="reduced")[0]
    bell = extra * np.exp(-(((x - place) / width) ** 2) / 2)
    force = c.viscous[0] * np.gradient(x, time) + c.coulomb[0] + bell
    assert STIFFNESS * (path[:, 0] - x)[2000:-2] == pytest.approx(force[2000:-2], rel=5e-3)


def test_load_friction_follows_the_other_axis():
    """x slides, y is pushed by F against its belts: K lag = b v + f + coefficient F."""
    push, coefficient = 2.0, 0.3
    frictionless_y = {"bridge_coulomb_friction": 0.0, "bridge_viscous_friction": 20.0}
    time, path = polyline([(0, 0), (0.06, 0)], 0.03)
    lags = []
    for share in (0.0, coefficient):
        effects = [("constant_force", "y", (push,))]
        effects += [("load_friction", "x", (share,))] if share else []
        values = vector(effects=effects, **frictionless_y)
        lags.append(path[-1, 0] - run(drive(time, path), values, fidelity="reduced")[0, -1])
    assert STIFFNESS * (lags[1] - lags[0]) == pytest.approx(coefficient * push, rel=1e-4)


@pytest.mark.parametrize("speed", [0.02, 0.08])
def test_drag_grows_with_the_square_of_speed(speed):
    drag = slide_at(speed, [("quadratic_drag", "x", (300.0,))]) - slide_at(speed, [])
    assert STIFFNESS * drag == pytest.approx(300 * speed**2, rel=1e-4)


def test_warm_friction_fades_from_the_start_of_the_run():
    """The excess of K lag is f ratio exp(-t / T), whatever the clock said at the start."""
    ratio, fade, c = 2.0, 0.7, REDUCED.constants(parameters(), 0.0)
    time, path = polyline([(0, 0), (0.06, 0)], 0.03)
    for begun in (0.0, 500.0):
        given = drive(time + begun, path)
        with_it = vector(effects=[("friction_warmup", "x", (ratio, fade))])
        lag = (run(given, vector(), fidelity="reduced") - run(given, with_it, fidelity="reduced"))[
            0
        ]
        late = time > 0.3
        expected = c.coulomb[0] * ratio * np.exp(-time / fade)
        slow = c.viscous[0] / STIFFNESS / fade  # the excess sinks while friction resists it
        assert (STIFFNESS * lag / expected)[late] == pytest.approx(1 + slow, rel=5e-3)


def test_a_cable_deflects_the_stage():
    """K x = -k (x - c)."""
    stiffness, center = 200.0, 0.1
    x, y = at_rest([("cable_drag", "x", (stiffness, center))])
    assert x == pytest.approx(stiffness * center / (STIFFNESS + stiffness), rel=1e-6)
    assert abs(y) < 1e-12


def test_a_periodic_force_shakes_at_its_frequency():
    """Far below resonance: x = a sin(2 pi f t + phase) / |K + i b w|, late by its angle."""
    size, frequency, phase = 0.5, 7.0, 0.4
    effects = [("periodic_disturbance", "x", (size, frequency, phase))]
    values = vector(effects=effects, **FRICTIONLESS)
    given = still(2001)
    x = run(given, values, fidelity="reduced")[0]
    omega = 2 * np.pi * frequency
    c = REDUCED.constants({**parameters(), **FRICTIONLESS}, 0.0)
    response = 1 / (STIFFNESS - c.mass[0] * omega**2 + 1j * c.viscous[0] * omega)
    expected = size * (response * np.exp(1j * (omega * given.time + phase))).imag
    assert np.abs(x - expected)[1000:].max() < 2e-3 * size / STIFFNESS


# belts


def test_a_slack_section_gives_no_more():
    """Below slack the belts are as ever; above, only the pulling side holds the carriage."""
    small, large, pretension = 0.5, 6.0, 1.0
    slack = [("belt_slack", "belts", (pretension,))]
    bare = {f: at_rest([("constant_force", "x", (f,))]) for f in (small, large)}
    found = {f: at_rest([*slack, ("constant_force", "x", (f,))]) for f in (small, large)}
    assert found[small] == pytest.approx(bare[small], abs=1e-12)
    assert found[large][0] > 1.05 * bare[large][0]
    effects = [*slack, ("constant_force", "x", (large,))]
    names = tuple(f"tension{i}" for i in range(1, 13))
    tension = at_rest(effects, channels=names)
    assert tension.min() == pytest.approx(-pretension)
    assert -tension[[0, 11]].sum() + tension[[5, 6]].sum() == pytest.approx(-large, rel=1e-5)


def test_belt_damping_is_the_nominal_damping_time():
    """The effect and the machine file's number are the same physics."""
    given = drive(*lively())
    values = vector(effects=[("belt_damping", "belts", (4e-4,))])
    both = vector(effects=[("belt_damping", "belts", (1e-4,))], belt_damping_time=3e-4)
    alone = run(given, vector(belt_damping_time=4e-4), limit=5e-5)
    for other in (values, both):
        assert np.abs(run(given, other, limit=5e-5) - alone).max() < 1e-12
    assert np.abs(alone - run(given, vector(), limit=5e-5)).max() > 1e-6


@pytest.mark.parametrize("coefficient", [50.0, 300.0])
def test_hardening_is_the_gradient_of_its_energy(coefficient):
    """V = sum k e^2 / 2 (1 + c e / 3 l)."""
    p, rng = parameters(), np.random.default_rng(3)
    probe = Probe(vector(effects=[("belt_hardening", "belts", (coefficient,))], **QUIET))
    c = FULL.constants(p, 0.0)
    rows, k, length = FULL.rows(R), np.array(c.stiffness), np.array(c.length)

    def energy(q):
        e = rows @ q
        return np.sum(k * e**2 / 2 * (1 + coefficient * e / (3 * length)))

    for _ in range(10):
        q = rng.uniform(-1, 1, 12) * np.array([5e-5, 5e-5, *[0.01] * 10])
        assert np.abs(coefficient * (rows @ q) / length).max() < 1
        forces = probe.accelerations(q, 0 * q) * np.array(c.mass)
        for i in (0, 1, *range(4, 12)):
            d = 1e-6 * (1e-2 if i < 2 else 1.0) * np.eye(12)[i]
            slope = (energy(q + d) - energy(q - d)) / (2 * d[i])
            assert forces[i] == pytest.approx(-slope, rel=1e-4, abs=1e-6 * np.abs(forces).max())


@pytest.mark.parametrize("fidelity", ["full", "reduced"])
def test_relaxed_belts_are_softer(fidelity):
    """At last a load F deflects by F / K (1 - ratio); half of the creep is done in its time."""
    ratio, fade, force = 0.4, 0.3, 2.0
    effects = [("belt_relaxation", "belts", (ratio, fade)), ("constant_force", "x", (force,))]
    light = {**DAMPED, "carriage_viscous_friction": 5.0}
    x = run(still(6000), vector(effects=effects, **light), fidelity=fidelity)[0]
    assert x[-1] == pytest.approx(force / (STIFFNESS * (1 - ratio)), rel=1e-5)
    creep = fade / (1 - ratio)  # a held load creeps more slowly than a held elongation relaxes
    end, begin = x[-1], force / STIFFNESS
    late = np.arange(300, 2000)
    expected = end - (end - begin) * np.exp(-late * 1e-3 / creep)
    assert np.abs(x[late] - expected).max() < 0.02 * (end - begin)


# motors


@pytest.mark.parametrize("name", ["tooth_ripple", "microstep_error"])
@pytest.mark.parametrize(("motor", "sign"), [("motor1", 1), ("motor2", -1)])
def test_ripples_have_their_amplitude_and_period(name, motor, sign):
    """Half of a motor's error goes to x, half to y: r a sin(50 phi + p) or a sin(z phi + p)."""
    time, path = polyline([(0, 0), (0.05, 0.02)], 0.05)
    angle = angles_of(path)[:, 0 if sign > 0 else 1]
    numbers = (2e-5, 0.6, 17.0) if name == "tooth_ripple" else (4e-3, 0.6)
    error = 2e-5 * np.sin(17 * angle + 0.6)
    if name == "microstep_error":
        error = R * 4e-3 * np.sin(50 * angle + 0.6)
    x, y = run(drive(time, path), vector(effects=[(name, motor, numbers)]), fidelity="kinematic")
    assert x - path[:, 0] == pytest.approx(error / 2, abs=1e-12)
    assert y - path[:, 1] == pytest.approx(sign * error / 2, abs=1e-12)


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
    values = vector(effects=[("missed_steps", "motor1", (steps, 0.25))], **DAMPED)
    jump = run(drive(time, path), values, fidelity=fidelity)
    jump -= run(drive(time, path), vector(**DAMPED), fidelity=fidelity)
    assert np.abs(jump[:, time < 0.25]).max() == 0.0
    assert jump[:, -1] == pytest.approx(R * steps * STEP_ANGLE / 2, rel=1e-4)


def test_detents_hold_a_stepper_off_its_command():
    """T_h sin(50 d) = -T_d sin(200 (phi_c + d) + phase) at rest, in both motors."""
    torque, phase, holding = 0.02, 0.8, 0.3
    effects = [("detent_torque", "motors", (torque, phase, 200.0, holding, 5e-3))]
    phi1, phi2 = at_rest(effects, channels=("phi1", "phi2"))
    balance = holding * np.sin(50 * phi1) + torque * np.sin(200 * phi1 + phase)
    assert phi1 == phi2 != 0
    assert balance == pytest.approx(0, abs=1e-9)


def held(effects, volts, channels, rows=60, **nominal):
    """A dc run with rotors so heavy that they do not turn."""
    light = {"motor_inertia": 1.0, "pulley_coulomb_friction": 0.0, **nominal}
    values = vector("yin2018_dc", effects, **light)
    given = still(rows, 5e-4, volts, "voltages")
    return given.time, run(given, values, dc=True, channels=channels)


def test_the_current_rises_with_the_windings_time_constant():
    """A voltage step on a held rotor: tau = K_1 V (1 - exp(-t / T))."""
    gain = parameters("yin2018_dc")["motor_torque_gain"]
    time, (torque, speed) = held(
        [("winding_lag", "motors", (4e-3,))], (6.0, 0.0), ("torque1", "omega1")
    )
    back = parameters("yin2018_dc")["motor_damping_gain"] * speed
    expected = gain * 6.0 * (1 - np.exp(-time / 4e-3))
    assert np.abs(torque + back - expected)[1:].max() < 0.02 * gain * 6.0


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


def test_commutation_ripples_with_the_angle():
    """Turning steadily, tau = K_1 V (1 + ratio sin(order phi + phase)) but for back-EMF."""
    ratio, order, phase, p = 0.3, 7.0, 0.5, parameters("yin2018_dc")
    values = vector("yin2018_dc", [("torque_ripple", "motors", (ratio, order, phase))])
    given = still(400, 2.5e-4, (3.0, 3.0), "voltages")
    names = ("torque1", "phi1", "omega1")
    torque, phi, omega = run(given, values, dc=True, channels=names, limit=2e-5)
    whole = p["motor_torque_gain"] * 3.0 - p["motor_damping_gain"] * omega
    expected = whole * (1 + ratio * np.sin(order * phi + phase))
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
