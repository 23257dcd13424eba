"""The closed form, limit or energy that each effect's law must meet."""

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

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import Excitation
from corexy_fmi.topology import FULL, REDUCED
from corexy_fmi.topology.corexy import equivalent_stiffness

R = 5e-3


@pytest.mark.parametrize(("location", "share"), [("motors", 1.0), ("motor1", 0.5), ("motor2", 0.5)])
@pytest.mark.parametrize("fidelity", ["kinematic", "full"])
def test_backlash_loses_its_gap_at_a_reversal(location, share, fidelity):
    """x moves by r gap (of both motors together) less than commanded, either way."""
    gap = 0.04
    time, path = polyline([(0, 0), (2e-3, 0), (0, 0)], 5e-3)
    values = vector(effects=[("backlash", location, (gap, 1.0))], **FRICTIONLESS)
    x, _ = run(drive(time, path), values, fidelity=fidelity)
    bare = run(drive(time, path), vector(**FRICTIONLESS), fidelity=fidelity)[0]
    late = np.searchsorted(time, [0.3, 0.7])
    lost = (bare - x)[late]
    assert lost == pytest.approx(share * R * gap / 2 * np.array([1, -1]), rel=1e-3, abs=1e-8)


def test_backlash_floats_without_grip():
    """Inside its gap a loose pulley carries no force: it goes where the belts pull nothing."""
    time, path = polyline([(0, 0), (1e-4, 0), (-1e-4, 0)], 1e-3)
    values = vector(effects=[("backlash", "motors", (0.1, 1e-5))], carriage_coulomb_friction=5.0)
    x, _ = run(drive(time, path), values)
    firm = vector(effects=[("backlash", "motors", (0.1, 1.0))], carriage_coulomb_friction=5.0)
    tensions = [run(drive(time, path), v, channels=("tension3",)) for v in (values, firm)]
    assert np.abs(x).max() == 0.0
    assert np.abs(tensions[0]).max() < 2.5e-3 + 1e-5 / R


def test_a_loose_pulley_goes_where_its_energy_is_least():
    """The law's closed form against the least of all places where the sum may have its minimum."""
    contact = next(law for law in catalogue()["backlash"].laws if law.port == "contact").function
    rng = np.random.default_rng(3)
    for _ in range(400):
        pull, seat, lag = rng.normal(size=3)
        grip, hold = rng.choice([0.0, 0.3, 2.0], 2)
        k, gap, travel = 1.7, rng.choice([0.5, 50.0]), 0.4
        found = contact(0.0, pull, k, travel, 1.0, seat, lag, gap, grip, hold)
        free = [(pull + a * grip + b * hold) / k for a in (-1, 1) for b in (-1, 1)]
        d = np.clip([found["offset"], seat - travel, lag, *free], -gap / 2, gap / 2)
        energy = k * (d - pull / k) ** 2 / 2 + grip * abs(d + travel - seat) + hold * abs(d - lag)
        assert abs(found["offset"]) <= gap / 2
        assert energy[0] == pytest.approx(energy.min(), abs=1e-12)
        assert found["lag"] == found["offset"] == pytest.approx(found["seat"] - travel)


def test_a_pulley_that_its_shaft_holds_has_no_play():
    time, path = polyline([(0, 0), (0.02, 0), (0, 0)], 0.05)
    values = vector(effects=[("backlash", "motors", (0.02, 1e-5, 50.0))])
    held, bare = (run(drive(time, path), v) for v in (values, vector()))
    assert held == pytest.approx(bare, abs=1e-9)


@pytest.mark.parametrize(("location", "parameter"), [("motor1", 0), ("motor2", 1)])
@pytest.mark.parametrize("begins", [-1.0, 0.3])
def test_a_loose_pulley_begins_where_it_is_said_to(location, parameter, begins):
    """Without motion the stage rests off by r gap begins / 4: half of the offset of one motor."""
    gap, seats = 0.02, [0.0, 0.0]
    seats[parameter] = begins
    values = vector(effects=[("backlash", location, (gap, 1.0, 0.0, *seats))], **FRICTIONLESS)
    still = Excitation(np.arange(5) * 1e-3, np.zeros(5), np.zeros(5))
    x, y = run(still, values, fidelity="kinematic")
    assert x[-1] == pytest.approx(R * gap * begins / 4, rel=1e-9)
    assert abs(y[-1]) == pytest.approx(abs(x[-1]), rel=1e-9)


@pytest.mark.parametrize(
    ("location", "wx", "wy"), [("motor1", 0.5, 0.5), ("motor2", 0.5, -0.5), ("motors", 1, None)]
)
def test_eccentric_motor_pulley(location, wx, wy):
    """x = (u_1 + u_2) / 2 with u_i = r phi_i + a (sin(phi_i + phase) - sin phase)."""
    amplitude, phase = 5e-5, 0.7
    time, path = polyline([(0, 0), (0.05, 0.02)], 0.05)
    values = vector(effects=[("pulley_eccentricity", location, (amplitude, phase))])
    x, y = run(drive(time, path), values, fidelity="kinematic")
    phi1, phi2 = angles_of(path).T
    first, second = (amplitude * (np.sin(phi + phase) - np.sin(phase)) for phi in (phi1, phi2))
    if location == "motors":
        assert x - path[:, 0] == pytest.approx((first + second) / 2, abs=1e-12)
        assert y - path[:, 1] == pytest.approx((first - second) / 2, abs=1e-12)
    else:
        error = first if location == "motor1" else second
        assert x - path[:, 0] == pytest.approx(wx * error, abs=1e-12)
        assert y - path[:, 1] == pytest.approx(wy * error, abs=1e-12)


@pytest.mark.parametrize("location", ["motor1", *(f"pulley{i}" for i in range(3, 11))])
def test_eccentric_pulley_at_rest_minimises_the_energy(location):
    """Frictionless but damped, long after the move: x, y where V with shifted rims is least."""
    amplitude, phase, p = 2e-4, 0.4, parameters()
    effects = [("pulley_eccentricity", location, (amplitude, phase))]
    values = vector(effects=effects, belt_damping_time=1e-3, **FRICTIONLESS)
    time, path = polyline([(0, 0), (4e-3, 1e-3)], 2e-2, rest=1.5)
    end = np.array([v[-1] for v in run(drive(time, path), values)])
    rows, k = FULL.rows(R), np.array(FULL.constants(p, 0.0).stiffness)
    number = int(location.removeprefix("motor").removeprefix("pulley"))
    free = np.array([0, 1, *range(4, 12)])
    q = np.zeros(12)
    q[2:4] = angles_of(path[-1:])[0]
    for _ in range(30):  # the shift depends on the idler's own angle
        angle, coordinate = q[number + 1], number + 1
        shift = amplitude * (np.sin(angle + phase) - np.sin(phase))
        slope = amplitude * np.cos(angle + phase)
        if number <= 2:
            extra = FULL.rows(1.0)[:, coordinate] * shift
            lean = rows
        else:
            near = np.abs(FULL.rows(1.0)[:, coordinate]) / 2
            extra, lean = near * shift, rows.copy()
            lean[:, coordinate] += near * slope
        residual = lean[:, free].T @ (k * (rows @ q + extra))
        q[free] -= np.linalg.solve(lean[:, free].T @ (k[:, None] * lean[:, free]), residual)
    assert end == pytest.approx(q[:2], abs=2e-9)
    assert np.abs(end - path[-1]).max() > 1e-6


@pytest.mark.parametrize("fidelity", ["full", "reduced"])
def test_belt_mismatch_deflects_across_a_load(fidelity):
    """A force along x: x = F (k_1 + k_2) / 4 k_1 k_2, y = -F (k_1 - k_2) / 4 k_1 k_2."""
    ratio, force = 0.5, 2.0
    effects = [("belt_mismatch", "belts", (ratio,)), ("constant_force", "x", (force,))]
    still = Excitation(np.arange(3000) * 1e-3, np.zeros(3000), np.zeros(3000))
    x, y = run(still, vector(effects=effects, **FRICTIONLESS), fidelity=fidelity)
    k = equivalent_stiffness(parameters())
    k1, k2 = k * (2 + 2 * ratio) / (2 + ratio), 2 * k / (2 + ratio)
    assert k1 / k2 - 1 == pytest.approx(ratio)
    assert x[-1] == pytest.approx(force * (k1 + k2) / (4 * k1 * k2), rel=1e-6)
    assert y[-1] == pytest.approx(-force * (k1 - k2) / (4 * k1 * k2), rel=1e-6)


def belt_energy(q, p, strength, parallel):
    """V [J] with real section lengths, typed from PHYSICS 3 and (6), apart from the table."""
    x, y, phi = q[0], q[1], dict(zip(range(1, 11), p["pulley_radius"] * q[2:], strict=True))
    w, h, c = p["bridge_pulley_spacing"], p["motor_idler_span"], p["clip_spacing"]
    sections = [
        ((w - c) / 2, x, phi[3] + x),
        ((w - c) / 2, x, phi[5] - x),
        ((w - c) / 2, -x, phi[4] + x),
        ((w - c) / 2, -x, phi[6] - x),
        (h / 2, y, phi[3] + phi[1] - y),
        (h / 2, y, phi[4] + phi[2] + y),
        (h, 0, phi[9] - phi[1]),
        (h, 0, phi[10] - phi[2]),
        (w, 0, phi[9] - phi[8]),
        (w, 0, phi[10] - phi[7]),
        (h / 2, -y, phi[8] - phi[6] - y),
        (h / 2, -y, phi[7] - phi[5] + y),
    ]
    behind = sum(e**2 / (length + strength * moved) for length, moved, e in sections)
    real = sum(e**2 / (length + moved) for length, moved, e in sections)
    beside = sum((1 - strength) * e**2 / length for length, _, e in sections) + strength * real
    return p["belt_axial_stiffness"] / 2 * ((1 - parallel) * behind + parallel * beside)


@pytest.mark.parametrize(("strength", "parallel"), [(0.5, 0.0), (1.0, 0.0), (0.5, 1.0), (0.3, 0.4)])
def test_stiffness_vs_position_is_the_gradient_of_its_energy(strength, parallel):
    p, rng = parameters(), np.random.default_rng(5)
    quiet = {n: 0.0 for n in p if n.endswith("friction")}
    used = ("belt_stiffness_vs_position", "belts", (strength, parallel))
    probe = Probe(vector(effects=[used], **quiet))
    mass = np.array(FULL.constants(p, 0.0).mass)
    free = np.array([0, 1, *range(4, 12)])
    for _ in range(10):
        q = rng.normal(size=12) * np.array([1e-3, 1e-3, *[0.2] * 10])
        q[:2] += rng.uniform(-0.05, 0.05, 2)
        forces = probe.accelerations(q, 0 * q) * mass
        for i in free:
            d = 1e-6 * (1e-2 if i < 2 else 1.0) * np.eye(12)[i]
            high, low = (belt_energy(q + shift, p, strength, parallel) for shift in (d, -d))
            slope = (high - low) / (2 * d[i])
            assert forces[i] == pytest.approx(-slope, rel=1e-4, abs=1e-6 * np.abs(forces).max())


def rest_of_free_run(values, rows=4000, **options):
    """The last row of a run with motors commanded to zero."""
    still = Excitation(np.arange(rows) * 1e-3, np.zeros(rows), np.zeros(rows))
    return run(still, values, **options)[:, -1]


def test_rotor_gives_way_by_its_static_law():
    """A load F on x puts r F / 2 on each rotor: sin(50 delta) = r F / 2 T_h."""
    holding, force = 0.05, 3.0
    effects = [("stepper_compliance", "motors", (holding, 5e-3)), ("constant_force", "x", (force,))]
    values = vector(effects=effects, **FRICTIONLESS)
    x, phi1, phi2, torque = rest_of_free_run(values, channels=("x", "phi1", "phi2", "torque1"))
    expected = np.arcsin(R * force / 2 / holding) / 50
    assert [phi1, phi2] == pytest.approx([expected] * 2, rel=1e-6)
    k = equivalent_stiffness(parameters())
    assert x == pytest.approx(R * expected + force / (2 * k), rel=1e-6)
    assert torque == pytest.approx(-R * force / 2, rel=1e-6)


def test_rotor_rings_at_the_frequency_of_its_magnetic_spring():
    """w^2 = 50 T_h / J where the belt is soft."""
    holding, still = 0.2, {n: 0.0 for n in parameters() if n.endswith("friction")}
    values = vector(effects=[("stepper_compliance", "motors", (holding, 0.0))], **still)
    values[6] = 10.0
    time = np.arange(2000) * 1e-4
    angle = np.minimum(time, 0.01)
    given = Excitation(time, angle, angle)
    inertia = parameters()["motor_inertia"] + 2e-7
    phi = run(given, values, fidelity="reduced", channels=("phi1",), limit=1e-5)[0]
    ring = (phi - phi[time > 0.011].mean())[time > 0.011]
    crossings = np.flatnonzero(ring[:-1] * ring[1:] < 0)
    share = ring[crossings] / (ring[crossings] - ring[crossings + 1])
    moments = (crossings + share) * 1e-4
    found = np.pi * (len(moments) - 1) / (moments[-1] - moments[0])
    assert found == pytest.approx(np.sqrt(50 * holding / inertia), rel=2e-3)


def test_a_stiff_rotor_is_no_effect():
    time = np.arange(1000) * 1e-3
    gentle = drive(
        time, np.column_stack([5e-3 * np.sin(6 * time) ** 2, 5e-3 * np.sin(4 * time) ** 2])
    )
    bare = run(gentle, vector())
    apart = [
        np.abs(
            run(gentle, vector(effects=[("stepper_compliance", "motors", (t, 5e-3))])) - bare
        ).max()
        for t in (0.5, 5.0)
    ]
    assert apart[1] < 1e-6
    assert apart[1] == pytest.approx(apart[0] / 10, rel=0.2)


def test_tool_rings_at_its_frequency_and_damping():
    """On a carriage that friction has stopped, the tool rings down as a damped oscillator alone."""
    frequency, ratio = 40.0, 0.03
    heavy = {"carriage_mass": 5.0, "carriage_coulomb_friction": 30.0, "belt_axial_stiffness": 1e6}
    values = vector("gt2_printer", [("tool_mode", "tool", (1e-3, frequency, ratio))], **heavy)
    time, path = polyline([(0, 0), (0.02, 0)], 0.05, row=2e-4, rest=0.8)
    z, x = run(drive(time, path, values[0]), values, channels=("x", "x_true"))
    stuck = np.flatnonzero(np.diff(x))[-1] + 2
    swing = (z - x)[stuck:]
    assert len(swing) > 3000
    spectrum = np.abs(np.fft.rfft(swing * np.hanning(len(swing)), 1 << 17))
    found = np.fft.rfftfreq(1 << 17, 2e-4)[np.argmax(spectrum)]
    assert found == pytest.approx(frequency * np.sqrt(1 - ratio**2), rel=3e-3)
    peaks = np.flatnonzero((swing[1:-1] > swing[:-2]) & (swing[1:-1] > swing[2:])) + 1
    decrement = np.log(swing[peaks[0]] / swing[peaks[8]]) / 8
    assert decrement == pytest.approx(2 * np.pi * ratio / np.sqrt(1 - ratio**2), rel=0.03)


def test_belts_accelerate_the_tool():
    """Under an acceleration a, the carriage lags by m a / 2 k_e more and the tool by a / w^2."""
    mass, frequency, acceleration = 0.3, 300.0, 1.0
    bare = vector("gt2_printer", **FRICTIONLESS)
    tool = [("tool_mode", "tool", (mass, frequency, 0.5))]
    time = np.arange(600) * 1e-3
    way = acceleration * time**2 / 2
    given = drive(time, np.column_stack([way, 0 * way]), bare[0])
    z, x = run(given, vector("gt2_printer", tool, **FRICTIONLESS), channels=("x", "x_true"))
    k = equivalent_stiffness(parameters("gt2_printer"))
    lag = (run(given, bare)[0] - x)[300:].mean()
    assert lag == pytest.approx(mass * acceleration / (2 * k), rel=5e-3)
    assert (x - z)[300:].mean() == pytest.approx(1 / (2 * np.pi * frequency) ** 2, rel=5e-3)


@pytest.mark.parametrize("delay", [1e-3, 0.0123, 0.05])
def test_delay_shifts_what_is_reported(delay):
    """x_m(t) = x(t - delay), at all rows and speeds; before the start: the start."""
    time, path = lively(200)
    values = vector(effects=[("sensor_delay", "sensor", (delay,))])
    late, true = run(drive(time, path), values, channels=("x", "x_true"), limit=2e-5)
    fine = np.arange(0, time[-1], 2e-5)
    dense = np.column_stack([np.interp(fine, time, column) for column in path.T])
    x = run(drive(fine, dense), vector())[0]
    assert np.abs(late - np.interp(time - delay, fine, x)).max() < 1e-7
    assert np.array_equal(true, run(drive(time, path), vector(), limit=2e-5)[0])


def test_skew_shears_what_is_reported():
    values = vector(effects=[("axis_skew", "sensor", (0.01,))])
    names = ("x", "y", "ax", "ay", "x_true", "y_true")
    seen = run(drive(*lively()), values, channels=names)
    true = run(drive(*lively()), vector(), channels=names)
    x, y, ax, ay = (true[i] for i in range(4))
    assert seen == pytest.approx(np.array([x - 0.01 * y, y, ax - 0.01 * ay, ay, x, y]), abs=1e-15)


@pytest.mark.parametrize("ratio", [1.0, 3.0])
def test_stribeck_breaks_away_at_its_ratio(ratio):
    """A slow pull along x: the carriage stays until 2 k_e lag = ratio (f_1 + 4 tau_f / r)."""
    p, speed = parameters(), 1e-3
    effects = [("stribeck_friction", "x", (ratio, 1e-3))] if ratio > 1 else []
    time, path = polyline([(0, 0), (1e-3, 0)], speed)
    x = run(drive(time, path), vector(effects=effects), fidelity="reduced")[0]
    left = time[np.flatnonzero(x)[0]]
    dry = p["carriage_coulomb_friction"] + 4 * p["pulley_coulomb_friction"] / R
    assert left == pytest.approx(ratio * dry / (2 * equivalent_stiffness(p)) / speed, abs=1.1e-3)


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0, 16.0])
def test_stribeck_follows_its_curve(share):
    """Steady sliding at v: 2 k_e lag = b v + f (1 + (ratio - 1) exp(-(v / v_s)^2))."""
    p, speed, ratio = parameters(), 0.04, 3.0
    values = vector(effects=[("stribeck_friction", "x", (ratio, speed / share))])
    time, path = polyline([(0, 0), (0.08, 0)], speed)
    x = run(drive(time, path), values, fidelity="reduced")[0]
    c = REDUCED.constants(p, 0.0)
    dry = c.coulomb[0] * (1 + (ratio - 1) * np.exp(-(share**2)))
    lag = (c.viscous[0] * speed + dry) / (2 * c.stiffness[0])
    assert path[-1, 0] - x[-1] == pytest.approx(lag, rel=1e-6)


def test_constant_force_is_friction_that_differs_by_direction():
    """A push F shifts the lag by F / 2 k_e, the same way in both directions of motion."""
    force, k = 0.6, equivalent_stiffness(parameters())
    time, path = polyline([(0, 0), (0.04, 0), (0, 0)], 0.04)
    pushed = run(drive(time, path), vector(effects=[("constant_force", "x", (force,))]))[0]
    shift = pushed - run(drive(time, path), vector())[0]
    for moment in (0.9, 1.9):
        found = shift[np.searchsorted(time, moment)]
        assert found == pytest.approx(force / (2 * k), rel=1e-3)
