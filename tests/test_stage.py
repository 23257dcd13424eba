"""The stage as a table: eq. (1), stiffness, Lagrange's equations, energy, the paper's numbers."""

import numpy as np
import pytest
import sympy
from kernel_helpers import DC, MACHINES, Probe, drive, lively, parameters, polyline, run, vector

from benchmarks.exact_stage import lagrange, matrices, section_stiffness
from corexy_fmi.corners import contour_error
from corexy_fmi.parameters import NOMINAL
from corexy_fmi.topology import CONDENSED, FULL, REDUCED, STAGES
from corexy_fmi.topology.corexy import equivalent_stiffness, idler_weights

RADIUS = 5e-3
SPEEDS = (0.020, 0.039, 0.079)  # [m/s] of PHYSICS 5
SINGLE = {  # single corners from a straight run, the other axis never moved [mm]
    ("full", "x->y"): (0.309, 0.572, 1.127),
    ("full", "y->x"): (0.135, 0.243, 0.471),
    ("reduced", "x->y"): (0.267, 0.492, 0.966),
    ("reduced", "y->x"): (0.023, 0.044, 0.088),
}
SECOND = {  # in a rectangle run, from the second corner on [mm]
    ("full", "y->x"): (0.1425, 0.2509, 0.480),
    ("reduced", "y->x"): (0.056, 0.0735, 0.117),
    ("full", "x->y"): (0.309, 0.573, 1.128),
}


def equation_1(stage, radius):
    """Positions of all coordinates for x = 1 and for y = 1 [m], by (1) and PHYSICS 2."""
    turns = {"x": (1, 0), "y": (0, 1), "phi1": (1, 1), "phi2": (1, -1), "phi3": (-1, 0)}
    turns |= {"phi4": (-1, 0), "phi5": (1, 0), "phi6": (1, 0), "phi7": (1, -1), "phi8": (1, 1)}
    turns |= {"phi9": (1, 1), "phi10": (1, -1)}
    scale = [1.0 if c in "xy" else 1 / radius for c in stage.coordinates]
    return np.array([turns[c] for c in stage.coordinates]) * np.array(scale)[:, None]


@pytest.mark.parametrize("stage", [FULL, REDUCED], ids=lambda s: s.name)
def test_no_energy_only_where_equation_1_holds(stage):
    rows, motion = stage.rows(RADIUS), equation_1(stage, RADIUS)
    assert np.abs(rows @ motion).max() < 1e-15
    assert np.linalg.matrix_rank(rows) == len(stage.coordinates) - 2


@pytest.mark.parametrize("belt", [1, 2])
def test_elongations_of_a_belt_sum_to_zero(belt):
    total = dict.fromkeys(FULL.coordinates, 0)
    for section in FULL.sections:
        if section.belt == belt:
            for coordinate, weight in section.row.items():
                total[coordinate] += weight
    assert set(total.values()) == {0}


def test_lengths_of_a_belt_keep_their_sum():
    for belt in (1, 2):
        slopes = [s.length_slope for s in FULL.sections if s.belt == belt]
        assert np.abs(np.sum(slopes, axis=0)).max() == 0


def test_lengths_follow_the_geometry():
    """A section between a pulley on the bridge or carriage and its neighbour (PHYSICS 3)."""
    slopes = {s.name: s.length_slope for s in FULL.sections}
    assert slopes["clip_left-3"] == slopes["5-clip_left"] == (1, 0)
    assert slopes["6-clip_right"] == slopes["clip_right-4"] == (-1, 0)
    assert slopes["3-motor1"] == slopes["4-motor2"] == (0, 1)
    assert slopes["8-6"] == slopes["7-5"] == (0, -1)
    assert slopes["9-8"] == slopes["10-7"] == slopes["motor1-9"] == (0, 0)


@pytest.mark.parametrize("machine", MACHINES)
def test_stiffness_is_the_hessian_of_equation_6(machine):
    p = parameters(machine)
    mass, stiffness, viscous, coulomb = matrices(p)
    assert FULL.stiffness_matrix(p) == pytest.approx(stiffness, rel=1e-12)
    assert FULL.stiffness_matrix(p) == pytest.approx(FULL.stiffness_matrix(p).T, abs=0)
    assert np.linalg.eigvalsh(stiffness).min() > -1e-9 * stiffness.max()
    c = FULL.constants(p, 0.0)
    assert c.mass == pytest.approx(mass)
    assert c.viscous == pytest.approx(viscous)
    assert c.coulomb == pytest.approx(coulomb)


@pytest.mark.parametrize("machine", MACHINES)
def test_static_condensation_of_the_idlers_is_the_reduced_stage(machine):
    p = parameters(machine)
    k = FULL.stiffness_matrix(p)
    condensed = k[:4, :4] - k[:4, 4:] @ np.linalg.solve(k[4:, 4:], k[4:, :4])
    assert condensed == pytest.approx(REDUCED.stiffness_matrix(p), rel=1e-9, abs=1e-9)


def test_equation_15_is_exact():
    """The same symbolically: k_e = k1 k2 / (k1 + k2) + 1 / (1/k1 + 1/k3 + 1/k4 + 1/k5)."""
    (q, v, symbols) = lagrange()[1]
    k = sympy.hessian(v, q)
    values = {p.name: sympy.Symbol(p.name, positive=True) for p in NOMINAL}
    sections = dict(zip(symbols[5:], section_stiffness(values), strict=True))
    idlers = list(range(4, 12))
    inner, outer = k.extract(idlers, idlers), k.extract(idlers, [0])
    numbers = {**sections, symbols[0]: values["pulley_radius"]}
    guess = {value: 1 + 0.1 * n for n, value in enumerate(values.values())}
    inner, outer = (m.subs(numbers).subs(guess) for m in (inner, outer))
    k_xx = k[0, 0].subs(numbers).subs(guess) - (outer.T * inner.LUsolve(outer))[0]
    expected = 2 * equivalent_stiffness(values).subs(guess)
    assert float(k_xx) == pytest.approx(float(expected), rel=1e-9)


def test_corrected_idler_equations_are_lagranges():
    """PHYSICS 2: what (8) should say, against -dV/dphi_i from (6)."""
    (q, v, symbols) = lagrange()[1]
    r, (k1, k2, k3, k4, k5) = symbols[0], symbols[5:]
    y, x, phi = q[1], q[0], dict(enumerate(q[2:], 1))
    for i in range(3, 11):
        e = (-1) ** (i + 1)
        if i <= 6:
            kb, s, j = (k2, 1, i - 2) if i in (3, 4) else (k5, -1, i + 2)
            said = -(k1 + kb) * r**2 * phi[i] - s * r * k1 * x + e * r * kb * y
            said -= s * r**2 * kb * phi[j]
        elif i <= 8:
            t, s = i - 2, 15 - (i - 2)
            said = -(k4 + k5) * r**2 * phi[i] - e * r * k5 * y + r**2 * (k4 * phi[s] + k5 * phi[t])
        else:
            s = i - 8
            said = -(k3 + k4) * r**2 * phi[i] + r**2 * (k3 * phi[s] + k4 * phi[9 - s])
        assert sympy.expand(said + sympy.diff(v, phi[i])) == 0, f"phi_{i}"


def test_the_printed_motor_equation_would_not_rest():
    """(10) prints + r k_2 y for both motors; where (1) holds that leaves motor 2 a force."""
    p = parameters()
    k, k2 = FULL.stiffness_matrix(p), section_stiffness(p)[1]
    assert k[3, 1] == pytest.approx(RADIUS * k2)
    assert k[2, 1] == pytest.approx(-RADIUS * k2)
    y = equation_1(FULL, RADIUS)[:, 1]
    printed = -k[3] @ y + 2 * RADIUS * k2
    assert abs(k[3] @ y) < 1e-12 < abs(printed)


def test_idlers_turn_with_their_motor():
    """(12) with J_1e and J_2e put right: 8, 9 turn with motor 1 and 7, 10 with motor 2."""
    x, y = equation_1(FULL, RADIUS).T
    for turn in (x, y):
        assert turn[9] == turn[10] == turn[2]
        assert turn[8] == turn[11] == turn[3]
    reduced = REDUCED.constants(parameters(), 0.0)
    assert reduced.mass[2:] == pytest.approx([5.4e-6 + 2e-7] * 2)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("motors", ["imposed", "free"])
def test_kernel_obeys_lagranges_equations(machine, motors):
    """12 accelerations at random states against (4), (6), (7), derived with SymPy."""
    p, rng = parameters(machine), np.random.default_rng(1)
    mass, k, viscous, coulomb = matrices(p)
    free = motors == "free"
    probe = Probe(vector(machine), drive=DC if free else 0)
    viscous = viscous + free * np.array([0, 0, *[p["motor_damping_gain"]] * 2, *[0] * 8])
    scale = np.array([1e-3, 1e-3, *[1e-3 / p["pulley_radius"]] * 10])
    for _ in range(10):
        q, v = rng.normal(size=12) * scale, rng.normal(size=12) * scale * 50
        expected = (-k @ q - viscous * v - coulomb * np.sign(v)) / mass
        found = probe.accelerations(q, v)
        kept = np.arange(12) if free else np.array([0, 1, *range(4, 12)])
        size = np.abs(k) @ np.abs(q) / mass
        assert np.abs((found - expected) / size)[kept].max() < 1e-3
        if not free:
            assert np.array_equal(probe.get()[1][2:4], v[2:4])


@pytest.mark.parametrize("ratio", [1.0, 3.0])
def test_smoothed_friction_is_nearly_tanh(ratio):
    """f tanh(1.056 v / v_s) within 2.2 % of f; rims count with r phi', and a scale of their own."""
    p, smooth = parameters("light_bench"), 5e-3 * np.array([1, 1, *[ratio] * 10])
    mass, _, viscous, coulomb = matrices(p)
    values = {"friction_smoothing": smooth[0], "pulley_smoothing_ratio": ratio}
    probe = Probe(vector("light_bench", **values))
    speed = np.array([2e-3, -4e-3, 0, 0, 1e-3, -3e-3, 8e-3, -2e-2, 4.9e-3, 5.1e-3, 0, -1e-4])
    scale = np.array([1, 1, *[RADIUS] * 10])
    v = speed / scale
    expected = -(viscous * v + coulomb * np.tanh(1.056 * speed / smooth)) / mass
    found = probe.accelerations(np.zeros(12), v, 1e-9)
    free = np.array([0, 1, *range(4, 12)])
    off = np.abs(found - expected)[free]
    assert np.all(off < (0.022 * coulomb / mass)[free] + 1e-4 * np.abs(expected[free]) + 1e-3)


def test_smoothing_goes_over_into_set_valued_friction():
    """The difference to exact stick and slip shrinks with the smoothing speed."""
    excitation, bare = drive(*lively(200)), vector("light_bench")
    exact, apart = run(excitation, bare), []
    for smooth in (1e-3, 1e-4, 1e-5):
        found = run(excitation, vector("light_bench", friction_smoothing=smooth))
        apart.append(np.abs(found - exact).max())
    assert apart[2] < 0.2 * apart[1] < 0.1 * apart[0]


def test_motors_pull_the_stage_to_half_their_travel():
    """As printed, (8) rests at dx / d(r phi_1) = 0.21; without friction it must be 0.5."""
    quiet = dict.fromkeys(("carriage_coulomb_friction", "bridge_coulomb_friction"), 0.0)
    values = vector(pulley_coulomb_friction=0.0, **quiet)
    probe = Probe(values)
    probe.drive(rates=(2.0, 0.0))
    probe.advance(1.0, 2e-4)
    probe.drive()
    probe.advance(3.0, 2e-4)
    q, _ = probe.get()
    assert q[:2] == pytest.approx([0.5 * 2.0 * RADIUS] * 2, rel=1e-9)


FRICTIONS = [p.name for p in NOMINAL if p.name.endswith("friction")]


def energy(stage, p, q, v):
    """T + V [J]."""
    mass = np.array(stage.constants(p, 0.0).mass)
    kinetic = mass * v**2 * (np.arange(len(q)) != 2) * (np.arange(len(q)) != 3)
    return 0.5 * (kinetic.sum() + q @ stage.stiffness_matrix(p) @ q)


def vibration(probe, stage, p, count, pieces, step):
    """Energies of a free vibration, after each of the pieces of count steps."""
    rng, found = np.random.default_rng(3), []
    q = rng.normal(size=len(stage.coordinates)) * np.where(
        np.arange(len(stage.coordinates)) < 2, 1e-3, 0.2
    )
    q[2:4] = 0
    probe.set(q, 0 * q)
    for _ in range(pieces):
        found.append(energy(stage, p, *probe.get()))
        probe.advance(count * step, step)
    return np.array(found)


@pytest.mark.parametrize("fidelity", ["full", "reduced", "condensed"])
def test_energy_is_conserved_without_friction(fidelity):
    """200 000 steps: the error is bounded, of second order, and does not drift."""
    p = parameters() | dict.fromkeys(FRICTIONS, 0.0)
    probe = Probe(vector(**dict.fromkeys(FRICTIONS, 0.0)), fidelity)
    coarse = vibration(probe, STAGES[fidelity], p, 40, 5000, 1e-5)
    fine = vibration(probe, STAGES[fidelity], p, 80, 2500, 5e-6)
    first, last = coarse[:1000].mean(), coarse[-1000:].mean()
    assert abs(last / first - 1) < 1e-5
    assert np.ptp(coarse) / first < 1e-3
    assert np.ptp(fine) / np.ptp(coarse) == pytest.approx(0.25, rel=0.1)


@pytest.mark.parametrize("fidelity", ["full", "reduced", "condensed"])
@pytest.mark.parametrize("kind", ["viscous", "coulomb"])
def test_energy_falls_with_friction(fidelity, kind):
    others = [name for name in FRICTIONS if kind not in name]
    p = parameters() | dict.fromkeys(others, 0.0)
    probe = Probe(vector(**dict.fromkeys(others, 0.0)), fidelity)
    found = vibration(probe, STAGES[fidelity], p, 10, 2000, 1e-5)
    assert np.diff(found).max() < 1e-6 * found[0]
    assert found[-1] < 0.6 * found[0]


def test_friction_takes_what_the_energy_loses():
    """Loss of T + V against the integral of d v^2 + f |v|, light_bench, 20 ms."""
    p, step = parameters("light_bench"), 1e-6
    _, _, viscous, coulomb = matrices(p)
    probe = Probe(vector("light_bench"))
    q = np.array([1e-3, -5e-4, 0, 0, 0.1, 0, -0.2, 0, 0, 0.1, 0, 0])
    probe.set(q, 0 * q)
    before, lost = energy(FULL, p, *probe.get()), 0.0
    for _ in range(20000):
        probe.advance(step, step)
        v = probe.get()[1]
        lost += step * (viscous @ v**2 + coulomb @ np.abs(v))
    assert before - energy(FULL, p, *probe.get()) == pytest.approx(lost, rel=2e-3)


def test_full_is_reduced_in_the_limit_of_light_frictionless_idlers():
    """Without inertia and friction of the idlers the 4-DoF model is exact (eq. 15)."""
    light = {"pulley_viscous_friction": 0.0, "pulley_coulomb_friction": 0.0}
    excitation, apart = drive(*lively(200, 5e-4)), {}
    for inertia in (1e-7, 1e-8, 1e-9):
        values = vector(pulley_inertia=inertia, **light)
        both = [run(excitation, values, fidelity=f) for f in ("full", "reduced")]
        apart[inertia] = np.abs(both[0] - both[1]).max()
    assert apart[1e-9] < 0.15 * apart[1e-8] < 0.03 * apart[1e-7]
    assert apart[1e-9] < 1e-6


def error_mm(excitation, corner, incoming, outgoing, window, **options):
    """Eq. (17) [mm] of a run at a corner, looked at within a window of rows."""
    x, y = run(excitation, vector(), **options)
    path = np.column_stack([x, y])[window]
    return 1e3 * contour_error(path, corner, np.array(incoming), np.array(outgoing))


@pytest.mark.parametrize(("fidelity", "turn"), SINGLE, ids="-".join)
def test_single_corners_of_physics_5(fidelity, turn):
    first, second = ((1, 0), (0, 1)) if turn == "x->y" else ((0, -1), (1, 0))
    for speed, expected in zip(SPEEDS, SINGLE[fidelity, turn], strict=True):
        length = max(1.5 * speed, 0.03)
        corner = length * np.array(first)
        points = [(0, 0), corner, corner + length * np.array(second)]
        excitation = drive(*polyline(points, speed))
        window = slice(len(excitation.time) // 4, None)
        found = error_mm(excitation, corner, first, second, window, fidelity=fidelity)
        assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("fidelity", "turn"), SECOND, ids="-".join)
def test_later_corners_of_a_rectangle_in_physics_5(fidelity, turn):
    """Stiction leaves x deflected after the first side."""
    for speed, expected in zip(SPEEDS, SECOND[fidelity, turn], strict=True):
        side = max(1.5 * speed, 0.03)
        points = side * np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)])
        index, incoming, outgoing = (
            (2, (0, 1), (-1, 0)) if turn == "y->x" else (3, (-1, 0), (0, -1))
        )
        excitation = drive(*polyline(points, speed))
        middle = np.searchsorted(
            excitation.time, (np.array([index - 0.5, index + 0.5])) * side / speed
        )
        found = error_mm(
            excitation, points[index], incoming, outgoing, slice(*middle), fidelity=fidelity
        )
        assert found == pytest.approx(expected, rel=0.02)


def test_dc_motors_reach_the_speed_of_their_balance():
    """Both motors at V: 2 K_1 V / r = all friction at that speed, back-EMF included."""
    p, volts = parameters("yin2018_dc"), 0.6
    probe = Probe(vector("yin2018_dc"), drive=DC)
    probe.drive(volts=(volts, volts))
    probe.advance(6.0, 2e-4)
    r = p["pulley_radius"]
    turning = 10 * p["pulley_viscous_friction"] + 2 * p["motor_damping_gain"]
    slope = p["carriage_viscous_friction"] + turning / r**2
    dry = p["carriage_coulomb_friction"] + 10 * p["pulley_coulomb_friction"] / r
    expected = (2 * p["motor_torque_gain"] * volts / r - dry) / slope
    _, v = probe.get()
    assert v[0] == pytest.approx(expected, rel=1e-6)
    assert abs(v[1]) < 1e-9


@pytest.mark.parametrize("machine", MACHINES)
def test_condensed_idlers_burden_by_their_static_weights(machine):
    """Against the condensation of the full stiffness matrix; PHYSICS 2 gives P1's weights."""
    p, r = parameters(machine), parameters(machine)["pulley_radius"]
    k = FULL.stiffness_matrix(p)
    follow = -r * np.linalg.solve(k[4:, 4:], k[4:, :4])  # r phi_j over x, y, phi1, phi2
    rolled = r * equation_1(FULL, r)[4:]
    in_x, in_y = (follow[:, axis] @ rolled[:, axis] for axis in (0, 1))
    assert idler_weights(p) == pytest.approx((in_x, in_y))
    c, base = CONDENSED.constants(p, 0.0), REDUCED.constants(p, 0.0)
    per_idler = p["pulley_viscous_friction"] / r**2
    assert c.viscous[0] == pytest.approx(p["carriage_viscous_friction"] + in_x * per_idler)
    assert c.viscous[1] == pytest.approx(p["bridge_viscous_friction"] + in_y * per_idler)
    assert c.mass[0] - p["carriage_mass"] == pytest.approx(in_x * p["pulley_inertia"] / r**2)
    assert c.stiffness == base.stiffness
    if machine == "yin2018":
        assert np.abs(follow[:, 0]) == pytest.approx(
            [0.625, 0.625, 0.885, 0.885, 0.692, 0.692, 0.385, 0.385], abs=1e-3
        )
        assert np.abs(follow[:, 1]) == pytest.approx(
            [0.375, 0.375, 0.115, 0.115, 0.692, 0.692, 0.385, 0.385], abs=1e-3
        )


@pytest.mark.parametrize(("turn", "short", "was"), [("x->y", -0.04, -0.14), ("y->x", -0.14, -0.81)])
def test_condensed_cuts_the_shortfall(turn, short, was):
    """PHYSICS 2: from -14 % / -81 % to -4 % / -14 % of the full model's corner error in P1."""
    first, second = ((1, 0), (0, 1)) if turn == "x->y" else ((0, -1), (1, 0))
    corner = 0.12 * np.array(first)
    given = drive(*polyline([(0, 0), corner, corner + 0.12 * np.array(second)], 0.079))
    window = slice(len(given.time) // 4, None)
    full, reduced, condensed = (
        error_mm(given, corner, first, second, window, fidelity=f)
        for f in ("full", "reduced", "condensed")
    )
    assert condensed / full - 1 == pytest.approx(short, abs=0.005)
    assert reduced / full - 1 == pytest.approx(was, abs=0.005)
