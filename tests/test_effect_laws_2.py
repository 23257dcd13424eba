"""The closed form or limit that each effect of guides and belts must meet."""

import numpy as np
import pytest
from kernel_helpers import (
    DAMPED,
    FRICTIONLESS,
    QUIET,
    STIFFNESS,
    Probe,
    at_rest,
    drive,
    lively,
    parameters,
    polyline,
    run,
    still,
    vector,
)
from scipy.linalg import expm
from scipy.stats import gamma

from corexy_fmi.effects.belt_slack import pull
from corexy_fmi.effects.presliding_hysteresis import YIELDS
from corexy_fmi.topology import FULL, REDUCED

R = 5e-3


def slide_at(speed, effects, fidelity="reduced", length=0.06):
    """Lag [m] behind a steady move along x."""
    time, path = polyline([(0, 0), (length, 0)], speed)
    x = run(drive(time, path), vector(effects=effects), fidelity=fidelity)[0]
    return path[-1, 0] - x[-1]


# guides


def dahl(u):
    """Friction over f_C at s x / f_C from rest."""
    return 1 - np.exp(-u)


def slipping(u):
    """The same of Maxwell's bristles, a quarter of the friction each."""
    return np.mean([np.clip(u / reach, -1, 1) for reach in YIELDS], axis=0)


@pytest.mark.parametrize(("law", "curve"), [(0.0, dahl), (1.0, slipping)])
@pytest.mark.parametrize("stiffness", [3e3, 3e4])
def test_bristles_bend_by_their_curve(stiffness, law, curve):
    """A slow pull: K (x_c - x) = f curve(s x / f) + b v, f the Coulomb friction."""
    c, speed = REDUCED.constants(parameters(), 0.0), 1e-4
    time, path = polyline([(0, 0), (3e-4, 0)], speed)
    values = vector(effects=[("presliding_hysteresis", "x", (stiffness, law))])
    x = run(drive(time, path), values, fidelity="reduced")[0]
    friction = c.coulomb[0] * curve(stiffness * x / c.coulomb[0])
    moving = np.gradient(x, time) * c.viscous[0]
    belts = STIFFNESS * (path[:, 0] - x)
    assert np.abs(belts - friction - moving)[50:].max() < 2e-3 * c.coulomb[0]
    assert friction.max() > 0.5 * c.coulomb[0]


def back_by_dahl(u):
    """Friction over f_C where sliding has turned, at s x / f_C since."""
    return 2 * np.exp(-u) - 1


def back_by_masing(u):
    """Masing's rule: the curve from rest, twice as large."""
    return 1 - 2 * slipping(u / 2)


@pytest.mark.parametrize(("law", "curve"), [(0.0, back_by_dahl), (1.0, back_by_masing)])
def test_bristles_bend_back(law, curve):
    """After sliding, Dahl's begin at 2 s and Maxwell's at s."""
    c, stiffness = REDUCED.constants(parameters(), 0.0), 1e5
    time, path = polyline([(0, 0), (4e-4, 0), (0, 0)], 1e-4)
    values = vector(effects=[("presliding_hysteresis", "x", (stiffness, law))])
    x = run(drive(time, path), values, fidelity="reduced")[0]
    turn = int(np.argmax(x))
    assert stiffness * x[turn] / c.coulomb[0] > max(YIELDS)  # it slides
    since = stiffness * (x[turn] - x) / c.coulomb[0]
    force = STIFFNESS * (path[:, 0] - x) - np.gradient(x, time) * c.viscous[0]
    missed = force - c.coulomb[0] * curve(since)
    assert since[-1] > 1
    assert np.abs(missed[turn + 20 : -2]).max() < 5e-3 * c.coulomb[0]


def test_yields_bend_by_dahls_curve():
    """Elements of all yields, distributed by y exp(-y), sum up to 1 - exp(-u); four of them within
    0.11 of it, with its slope at rest.
    """
    assert np.mean(1 / np.array(YIELDS)) == pytest.approx(1.0, abs=1e-5)
    medians = gamma(2).ppf([0.125, 0.375, 0.625, 0.875])
    assert np.array(YIELDS) / YIELDS[0] == pytest.approx(medians / medians[0], rel=1e-4)
    u = np.linspace(0, 5, 200)
    assert np.abs(slipping(u) - dahl(u)).max() < 0.11


def test_stiff_bristles_are_coulomb_friction():
    time, path = polyline([(0, 0), (0.01, 0), (0, 0)], 0.02, rest=0.1)
    bare = run(drive(time, path), vector())
    found = run(drive(time, path), vector(effects=[("presliding_hysteresis", "xy", (1e7, 0.0))]))
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


@pytest.mark.parametrize("along", [0.0, 1.0])
def test_load_friction_follows_the_belts(along):
    """x slides, y is pushed by F: K lag = b v + f + coefficient hypot(F, along K lag)."""
    push, coefficient = 2.0, 0.3
    frictionless_y = {"bridge_coulomb_friction": 0.0, "bridge_viscous_friction": 20.0}
    time, path = polyline([(0, 0), (0.06, 0)], 0.03)
    pulls = []
    for law in ((), (coefficient, along)):
        effects = [("constant_force", "y", (push,))]
        effects += [("load_friction", "x", law)] if law else []
        values = vector(effects=effects, **frictionless_y)
        reached = run(drive(time, path), values, fidelity="reduced")[0, -1]
        pulls.append(STIFFNESS * (path[-1, 0] - reached))
    load = np.hypot(push, along * pulls[1])
    assert pulls[1] - pulls[0] == pytest.approx(coefficient * load, rel=1e-4)


@pytest.mark.parametrize("speed", [0.02, 0.08])
def test_drag_grows_with_the_square_of_speed(speed):
    drag = slide_at(speed, [("quadratic_drag", "x", (300.0,))]) - slide_at(speed, [])
    assert STIFFNESS * drag == pytest.approx(300 * speed**2, rel=1e-4)


def test_warm_friction_fades_from_its_onset():
    """The excess of K lag is f ratio exp(-(t - onset) / T), whatever the clock said at first."""
    ratio, fade, c = 2.0, 0.7, REDUCED.constants(parameters(), 0.0)
    time, path = polyline([(0, 0), (0.06, 0)], 0.03)
    for begun, onset in ((0.0, 0.0), (500.0, 0.0), (0.0, 0.6), (0.0, -0.5)):
        given = drive(time + begun, path)
        with_it = vector(effects=[("friction_warmup", "x", (ratio, fade, onset))])
        lag = (run(given, vector(), fidelity="reduced") - run(given, with_it, fidelity="reduced"))[
            0
        ]
        late = (time > 0.3) & (np.abs(time - onset) > 0.1)
        expected = c.coulomb[0] * ratio * np.exp(-np.maximum(time - onset, 0) / fade)
        slow = c.viscous[0] / STIFFNESS / fade  # the excess sinks while friction resists it
        slow *= time[late] > onset
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


def test_strands_of_an_uneven_belt_go_slack_one_after_the_other():
    """The law is the mean of sharp ones over the width, and at rest no tension is added."""
    pretension, spread = 5.0, 0.6
    across = (np.arange(20_000) + 0.5) / 10_000 - 1
    strands = pretension * (1 + spread * across)
    for tension in (-9.0, -7.0, -5.0, -3.1, -2.0, 0.0, 4.0):
        mean = np.mean(np.maximum(tension + strands, 0.0)) - pretension
        assert pull(tension, pretension, spread)["tension"] == pytest.approx(mean, abs=1e-6)
    for spread in (0.0, 0.6, 1.0):
        assert pull(0.0, pretension, spread)["tension"] == pytest.approx(0.0, abs=1e-15)


def test_belt_damping_is_the_nominal_damping_time():
    """The effect and the machine file's number are the same physics."""
    given = drive(*lively())
    values = vector(effects=[("belt_damping", "belts", (4e-4,))])
    both = vector(effects=[("belt_damping", "belts", (1e-4,))], belt_damping_time=3e-4)
    alone = run(given, vector(belt_damping_time=4e-4), limit=5e-5)
    for other in (values, both):
        assert np.abs(run(given, other, limit=5e-5) - alone).max() < 1e-12
    assert np.abs(alone - run(given, vector(), limit=5e-5)).max() > 1e-6


@pytest.mark.parametrize("symmetric", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("coefficient", [50.0, 300.0])
def test_hardening_is_the_gradient_of_its_energy(coefficient, symmetric):
    """V = sum k e^2 / 2 (1 + c s / 3 l), s = e or |e|, or of both."""
    p, rng = parameters(), np.random.default_rng(3)
    probe = Probe(vector(effects=[("belt_hardening", "belts", (coefficient, symmetric))], **QUIET))
    c = FULL.constants(p, 0.0)
    rows, k, length = FULL.rows(R), np.array(c.stiffness), np.array(c.length)

    def energy(q):
        e = rows @ q
        strained = (1 - symmetric) * e + symmetric * np.abs(e)
        return np.sum(k * e**2 / 2 * (1 + coefficient * strained / (3 * length)))

    for _ in range(10):
        q = rng.uniform(-1, 1, 12) * np.array([5e-5, 5e-5, *[0.01] * 10])
        assert np.abs(coefficient * (rows @ q) / length).max() < 1
        forces = probe.accelerations(q, 0 * q) * np.array(c.mass)
        for i in (0, 1, *range(4, 12)):
            d = 1e-6 * (1e-2 if i < 2 else 1.0) * np.eye(12)[i]
            slope = (energy(q + d) - energy(q - d)) / (2 * d[i])
            assert forces[i] == pytest.approx(-slope, rel=1e-4, abs=1e-6 * np.abs(forces).max())


@pytest.mark.parametrize("spread", [0.0, 0.8])
@pytest.mark.parametrize("fidelity", ["full", "reduced"])
def test_relaxed_belts_are_softer(fidelity, spread):
    """At last a load F deflects by F / K (1 - ratio); two arms creep there in parallel."""
    ratio, fade, force = 0.4, 0.3, 2.0
    effects = [
        ("belt_relaxation", "belts", (ratio, fade, spread)),
        ("constant_force", "x", (force,)),
    ]
    light = {**DAMPED, "carriage_viscous_friction": 5.0}
    x = run(still(6000), vector(effects=effects, **light), fidelity=fidelity)[0]
    end, begin = force / (STIFFNESS * (1 - ratio)), force / STIFFNESS
    # x = begin + ratio (z_1 + z_2) / 2, and z' = (x - z) / t of each arm
    rates = 1 / (fade * np.exp([-spread, spread]))
    creep, late = rates[:, None] * (np.full((2, 2), ratio / 2) - np.eye(2)), np.arange(300, 2000)
    rest = np.array([expm(creep * n * 1e-3) @ [end, end] for n in late])
    assert np.abs(x[late] - (end - ratio * rest.mean(axis=1))).max() < 0.02 * (end - begin)
    if spread == 0:  # a held load creeps more slowly than a held elongation relaxes
        assert rest[:, 0] == pytest.approx(end * np.exp(-late * 1e-3 * (1 - ratio) / fade))
        assert x[-1] == pytest.approx(end, rel=1e-5)
