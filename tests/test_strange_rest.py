"""What is beside a strange stage with steppers: laws against closed forms and the energy, each new
cause's limit and step, the draws of the rest, and the older ones as they were.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from strange_kit import short_recordings, stretches

from benchmarks.shop.stage import Faults, stage
from benchmarks.strange import __main__ as strange
from benchmarks.strange import (
    beside,
    bodies,
    draw,
    evidence,
    machines,
    matrices,
    moves,
    page,
    pulls,
    running,
    sizes,
)
from benchmarks.strange import rest_causes as rest
from benchmarks.strange.beside import FRAME, TOOL, YAW, Beside, Body, Magnet, Ripple, Runout
from benchmarks.strange.cause import About
from corexy_fmi.effects import catalogue

KNOWN = {  # of the contract: places, parameters
    "belt_stiffness_vs_position": ("belts", "strength"),
    "belt_hardening": ("belts", "coefficient"),
    "belt_slack": ("belts", "pretension"),
    "belt_damping": ("belts", "time"),
    "belt_relaxation": ("belts", "ratio time_constant"),
    "pulley_eccentricity": (" ".join(f"pulley{n}" for n in range(3, 11)), "amplitude phase"),
    "stepper_compliance": ("motors", "holding_torque damping"),
    "detent_torque": ("motors", "torque phase"),
    "microstep_error": ("motor1 motor2 motors", "amplitude phase"),
    "tooth_ripple": ("motor1 motor2 motors", "amplitude phase teeth"),
    "load_friction": ("x y xy", "coefficient"),
    "presliding_hysteresis": ("x y xy", "stiffness"),
    "racking": ("bridge", "stiffness inertia"),
    "frame_mode": ("frame", "mass frequency damping_ratio"),
    "tool_mode": ("tool", "mass frequency damping_ratio"),
    "sensor_lag": ("sensor", "time_constant"),
    "clock_drift": ("sensor", "ratio"),
}
EACH = pytest.mark.parametrize("draws", rest.REST, ids=lambda d: d.__name__[1:])
SMOOTH = {"fx": 0.0, "fy": 0.0, "tf": 0.0}
FREE = SMOOTH | {"bx": 0.0, "by": 0.0, "Bp": 0.0}
LOOSE, HEAVY = {"AE": 1e-6}, {"mx": 1e7, "my": 1e7}  # belts that do nothing; a stage that stays
MICRON = 1e-6


def machine_of(seed, **numbers):
    machine = machines.draw_machine(draw.generator(seed, 0))
    return replace(machine, numbers={**machine.numbers, **numbers})


def about(seed, rows=700):
    """A machine and short motions for it."""
    machine, random = machine_of(seed), draw.generator(seed, 2)
    kinds = "scattered", "star", "zigzag"
    cut = [moves.draw_motion(random, machine, kind, 2e-3) for kind in kinds]
    return About(machine, [(time[:rows], xy[:rows]) for time, xy in cut])


def held(numbers, what, begin, seconds, row=1e-4, step=2e-5):
    """q and its rate over time, where both motors are held at 0."""
    time = np.arange(int(seconds / row)) * row
    return time, *bodies.simulate(time, np.zeros((len(time), 2)), numbers, what, step, begin)


def at(**places):
    """Coordinates by number, from _12 on as they are named, else 0."""
    q = np.zeros(beside.COUNT)
    for name, value in places.items():
        q[int(name[1:])] = value
    return q


def hertz(time, values):
    """Of a free vibration, by its crossings of 0."""
    up = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    share = values[up] / (values[up] - values[up + 1])
    return (len(up) - 1) / np.ptp((up + share)[[0, -1]]) / (time[1] - time[0])


def moved(here, acts, finer=1.0):
    return running.moved(here.machine, 0, here.motions[0], acts, finer=finer)


@pytest.mark.parametrize("seed", [0, 5, 22])
def test_with_nothing_beside_it_a_stage_moves_as_the_workshops(seed):
    here = about(seed)
    well, new = (moved(here, acts) for acts in (running.HEALTHY, running.Acts(beside=Beside())))
    assert np.abs(well - new).max() < MICRON / 20


@EACH
def test_a_cause_is_the_catalogues_and_tends_to_nothing(draws):
    here = about(0)
    cause = draws(np.random.default_rng(0), here)
    places, parameters = KNOWN[cause.name]
    assert cause.location in places.split()
    assert list(cause.parameters(cause.bounds[1])) == parameters.split()
    well = moved(here, cause.without)
    least, less, most = (
        np.abs(moved(here, cause.acts(size)) - well).max()
        for size in (1e-3 * cause.bounds[0], np.sqrt(np.prod(cause.bounds)), cause.bounds[1])
    )
    assert least < MICRON / 10
    assert least <= less <= most
    assert most > 5 * MICRON


@EACH
@pytest.mark.parametrize("seed", [0, 5])
def test_half_the_step_changes_less_than_half_a_micron(draws, seed):
    here = about(seed)
    acts = draws(np.random.default_rng(seed), here).acts
    low, high = draws(np.random.default_rng(seed), here).bounds
    size = np.sqrt(np.sqrt(low * high) * high)
    one, half = (moved(here, acts(size), finer) for finer in (1, 2))
    assert np.abs(one - half).max() < MICRON / 2


def potential(q, n, strength=0.0, hardening=0.0, runout=beside.ROUND):
    """(6), with lengths that follow x and y, cubes of the strain, half of a run-out on each side:
    from the parentheses of the paper, whose signs are chosen so that each idler hands belt on.
    """
    x, y = strength * q[:2]
    near, half = (n["W"] - n["c"]) / 2, n["H"] / 2
    lengths = np.array([near + x, near - x, near - x, near + x, half + y, half + y, n["H"], n["H"],
                        n["W"], n["W"], half - y, half - y])  # fmt: skip
    signs = np.array([1, -1, 1, -1, -1, 1, -1, 1, 1, -1, 1, -1])
    e = signs * np.array([s for s, _ in stretches(q[:12], n["r"])])
    off = np.sin(q[runout.idler + 1] + runout.phase) - np.sin(runout.phase)
    beside_it = {3: [0, 4], 4: [1, 5], 5: [3, 11], 6: [2, 10], 7: [9, 11], 8: [8, 10],
                 9: [6, 8], 10: [7, 9]}  # fmt: skip
    e[beside_it[runout.idler]] += runout.amplitude / 2 * off
    return float((n["AE"] / lengths * e**2 / 2 * (1 + hardening * np.abs(e) / lengths / 3)).sum())


def belts(q, numbers, what):
    """Forces of all belts."""
    of, e, force = matrices.whole(numbers, what, 1e-5), np.zeros(12), np.zeros(beside.COUNT)
    pulls.stretch(q, of, e)
    pulls.belts(q, e, e, of, force)
    return force


@pytest.mark.parametrize("word", ["nothing", "strength", "hardening", *range(3, 11)])
def test_belts_do_what_their_energy_says(word):
    n, random = machine_of(3).numbers, np.random.default_rng(1)
    told = {"nothing": {}, "strength": {"strength": 1.0}, "hardening": {"hardening": 80.0}}
    told = told.get(word, {"runout": Runout(word, 2e-4, 0.7)})
    q = np.concatenate([[0.02, -0.03], random.uniform(-0.3, 0.3, 10), np.zeros(5)])
    steps = np.eye(beside.COUNT)[:12] * 1e-6
    slopes = [(potential(q + d, n, **told) - potential(q - d, n, **told)) / 2e-6 for d in steps]
    assert belts(q, n, Beside(**told))[:12] == pytest.approx(-np.array(slopes), rel=1e-6, abs=1e-7)


def test_idlers_hand_on_what_belts_a_pull_stretches():
    """Neighbouring sections have each idler with opposite signs, and a belt's ends are tied."""
    table = matrices.linear(stage(machine_of(0).numbers, Faults()), machine_of(0).numbers, Beside())
    for part in table.table[:6], table.table[6:]:
        assert np.abs(part.sum(0)).max() < 1e-15
        assert (np.sort(part[:, 2:12], axis=0)[[0, -1]].sum(0) == 0).all()


def test_a_stage_off_its_place_is_held_by_its_tight_sections_alone():
    """Of each belt one side gives way: the others' springs in series, and twice the pretension."""
    n = machine_of(0, **SMOOTH, **HEAVY, Bp=1e-4).numbers
    d, held_by, k = 1e-3, 0.05, n["AE"] / np.array([(n["W"] - n["c"]) / 2, n["H"] / 2, n["H"],
                                                    n["W"], n["H"] / 2])  # fmt: skip
    short, long = 1 / (1 / k[:2]).sum(), 1 / (1 / k[[0, 2, 3, 4]]).sum()
    for pretension, expected in (
        (beside.ENDLESS, 2 * (short + long) * d),
        (held_by, (short + long) * d + 2 * held_by),
    ):
        what = Beside(pretension=pretension)
        _, q, _ = held(n, what, at(_0=d), 1.0)
        assert -belts(q[-1], n, what)[0] == pytest.approx(expected, rel=1e-3)


def test_dashpots_of_belts_are_those_of_the_linear_equations():
    machine, tau = machine_of(0, **SMOOTH), 2e-3
    n, free = machine.numbers, [0, 1, *range(4, 12)]
    of = stage(n, Faults())
    table = np.array([[s for s, _ in stretches(e, n["r"])] for e in np.eye(12)]).T
    k = n["AE"] / np.array([(n["W"] - n["c"]) / 2, n["H"] / 2, n["H"], n["W"], n["H"] / 2])
    k = (table.T @ (k[[i for _, i in stretches(np.zeros(12), 1)]][:, None] * table))[:, free][free]
    mass, drag = of.mass[free], np.diag(of.viscous[0][free]) + tau * k
    block = np.block(
        [[np.zeros((10, 10)), np.eye(10)], [-k / mass[:, None], -drag / mass[:, None]]]
    )
    begin = np.zeros(20)
    begin[0], begin[1] = 1e-3, -2e-3
    time, q, _ = held(n, Beside(damping=tau), at(_0=1e-3, _1=-2e-3), 0.1)
    exact = np.array([(expm(block * t) @ begin)[:2] for t in time[::50]])
    assert np.abs(q[::50, :2] - exact).max() < MICRON / 2


def test_a_belt_relaxes_to_what_stays_and_by_its_time():
    n = machine_of(0, **SMOOTH, **HEAVY, Bp=1e-4).numbers
    what, time = Beside(arm=0.5, relaxes=0.3), np.arange(20000) * 1e-4
    phi = np.where(time[:, None] > 0.1, [1e-2, 0.0], 0.0)
    _, rates = bodies.simulate(time, phi, n, what, 2e-5)
    force = n["mx"] * np.diff(rates[:, 0]) / 1e-4
    over = force / force[-100:].mean() - 1
    assert over[[1600, 4100]] == pytest.approx(
        0.5 * np.exp(-np.array([0.06, 0.31]) / 0.3), rel=0.02
    )


def test_without_losses_bodies_keep_the_energy():
    n = machine_of(0, **FREE).numbers
    what = Beside(
        magnet=Magnet(0.5, 1e-5, 0.0), yaw=Body(0.02, 30.0, 0.0),
        frame=Body(3.0, 12.0, 0.0), tool=Body(n["mx"] / 3, 25.0, 0.0),
    )  # fmt: skip
    of = matrices.linear(stage(n, Faults()), n, what)
    begin = at(_0=1e-3, _1=-1e-3, _2=2e-3, _12=1e-3, _13=1e-3, _16=5e-4)
    _, q, v = held(n, what, begin, 2.0)
    stiffness = stage(n, Faults()).stiffness
    stored = ((q @ of.table.T) ** 2 @ stiffness + q**2 @ of.springs) / 2
    stored += 0.5 / 50 * (1 - np.cos(50 * q[:, 2:4])).sum(1)
    whole = stored + np.einsum("ij,jk,ik->i", v, of.mass, v) / 2
    parts = whole.reshape(20, -1).mean(1)
    assert np.ptp(parts) < 2e-4 * parts.mean()
    assert np.ptp(stored) > 0.3 * whole.mean()
    assert (np.abs(q).max(0) > 0).all()


@pytest.mark.parametrize(
    ("what", "which", "expected"),
    [
        ({"frame": Body(50.0, 11.0, 0.0)}, FRAME, 11.0),
        ({"tool": Body(1e-4, 23.0, 0.0)}, TOOL + 1, 23.0),
        ({"yaw": Body(0.03, 40.0, 0.0)}, YAW, 40.0),
        ({"magnet": Magnet(0.3, 1e-5, 0.0)}, 2, np.sqrt(50 * 0.3 / 1e-5) / (2 * np.pi)),
    ],
)
def test_bodies_swing_at_their_frequencies(what, which, expected):
    n = machine_of(0, **FREE, **LOOSE, mx=0.1, my=0.15).numbers
    time, q, _ = held(n, Beside(**what), at(**{f"_{which}": 1e-4}), 1.0)
    assert hertz(time, q[:, which]) == pytest.approx(expected, rel=0.01)


def test_a_frame_is_pushed_by_what_pushes_the_stage_turned_round():
    n = machine_of(0, **FREE).numbers
    _, _, v = held(n, Beside(frame=Body(2.0, 1e-6, 0.0)), at(_0=1e-3, _1=1e-3), 0.5)
    moves = np.array([n["mx"], n["mx"] + n["my"] + 4 * n["mp"]])
    speeds = v[:, FRAME : FRAME + 2]
    sums = moves * (v[:, :2] + speeds) + 2.0 * speeds
    assert np.abs(sums).max() < 1e-9 * np.abs(moves * v[:, :2]).max()
    assert np.abs(speeds).max() > 1e-4


def test_a_yaw_feels_half_of_the_width_times_the_difference_of_forces():
    n, random = machine_of(0).numbers, np.random.default_rng(2)
    q = np.concatenate([random.uniform(-1e-3, 1e-3, 2), random.uniform(-0.1, 0.1, 10), [0.0] * 5])
    k = n["AE"] / (n["H"] / 2)
    e = [s for s, _ in stretches(q, n["r"])]
    left, right = k * (e[4] - e[11]), k * (e[10] - e[5])  # pulleys 3 and 5, then 6 and 4
    turned = belts(q, n, Beside(yaw=Body(0.02, 30.0, 0.0)))
    assert turned[1] == pytest.approx(left + right)
    assert turned[YAW] == pytest.approx((right - left) * n["W"] / 2)
    seen = bodies.reported(at(_0=0.1, _1=0.2, _12=1e-3, _15=1e-4, _16=2e-4)[None])[0]
    assert seen == pytest.approx([0.1001, 0.2003])


def rubbed(what, numbers, ways, across=(0.0, 0.0)):
    """Force at x and the most dry friction of x and y, along a way of x."""
    of, bent = matrices.whole(numbers, what, 1e-5), np.zeros((2, bodies.BRISTLES))
    seen, found, most = np.zeros(2), [], np.zeros(beside.COUNT)
    for way in ways:
        force = np.array([*across, *[0.0] * 15])
        bodies._guides(np.array([way, 0.0]), seen, bent, of, force, most)
        found.append(force[0] - across[0])
    return np.array(found), most[:2].copy()


def test_bristles_are_stiff_at_rest_and_slip_at_the_dry_friction():
    n = machine_of(0).numbers
    stiff, f = 1e5, n["fx"]
    out, back = np.linspace(0, 60 * f / stiff, 3000), np.linspace(60, -60, 6000) * f / stiff
    force, most = rubbed(Beside(bristles=(stiff, 0.0)), n, [*out, *back])
    assert force[1] / out[1] == pytest.approx(-stiff)
    assert force[[2999, -1]] == pytest.approx([-f, f])
    assert (np.diff(force[:3000]) <= 1e-12).all()
    assert force[3000 + 1] - force[3000] == pytest.approx(stiff * (back[0] - back[1]))
    assert most == pytest.approx([0.0, n["fy"]])


def test_a_pull_across_a_guide_presses_it():
    n = machine_of(0).numbers
    _, most = rubbed(Beside(loaded=(0.2, 0.1)), n, [0.0], across=(3.0, -7.0))
    share = n["mx"] / (n["mx"] + n["my"] + 4 * n["mp"])
    assert most == pytest.approx([n["fx"] + 0.2 * 7 * share, n["fy"] + 0.1 * 3])


def test_a_rotor_rests_between_its_detent_and_its_spring():
    n, magnet = machine_of(0, **SMOOTH, **LOOSE).numbers, Magnet(0.4, 1e-5, 5e-3, 0.05, 0.6)
    _, q, _ = held(n, Beside(magnet=magnet), None, 1.0)
    phi = q[-1, 2]
    assert 0.4 * np.sin(50 * phi) == pytest.approx(-0.05 * np.sin(200 * phi + 0.6), rel=1e-6)
    assert abs(phi) > 1e-4


def test_an_error_of_a_rotors_angle_shows_at_rest():
    n, order, phase = machine_of(0, **SMOOTH, bx=60.0, by=60.0).numbers, 50.0, 0.3
    at_rest, time = np.array([0.31, -0.24]), np.arange(2000) * 1e-3
    ripple = Ripple((0.01, 0.02), order, phase)
    q, _ = bodies.simulate(time, np.tile(at_rest, (2000, 1)), n, Beside(ripple=ripple), 2e-5)
    off = np.array(ripple.swings) * (np.sin(order * at_rest + phase) - np.sin(phase))
    phi = at_rest + off
    expected = n["r"] * np.array([phi.sum(), phi[0] - phi[1]]) / 2
    assert q[-1, :2] == pytest.approx(expected, abs=1e-9)


def test_a_filter_lags_by_its_time_and_a_clock_by_its_ratio():
    time = np.arange(0, 4, 1e-3)
    place = np.column_stack([0.1 * time, 0.2 * time])
    lag, clock = (d(np.random.default_rng(0), None) for d in rest.CLOCKS)
    shown = lag.acts(0.05).shown(0, time, place)
    exact = place - np.array([0.1, 0.2]) * 0.05 * (1 - np.exp(-time[:, None] / 0.05))
    assert np.abs(shown - exact).max() < 1e-12
    ratio = clock.parameters(0.01)["ratio"]
    assert abs(ratio) == 0.01
    early = clock.acts(0.01).shown(0, time, place)[:3000]
    assert np.abs(early - place[:3000] * (1 + ratio)).max() < 1e-12


def test_a_number_tells_the_kind_of_its_case(monkeypatch):
    asked = []
    monkeypatch.setattr(draw, "draw", lambda *of: asked.append(of[1:]))
    for number in (999, 1000, 1999, 2000, 2999, 3000, 3999, 4000):
        draw.drawn(number, 1)
    two, dc, others = (True, False, None), (False, True, None), (False, False, rest.REST)
    assert asked == [(False, False, None), two, two, dc, dc, others, others, (True, True, None)]
    nothing = {"effect": None, "location": None, "parameters": {}, "E0": 0.0}
    kinds = [page._concealed({"number": n, "truth": nothing}) for n in (999, 2999, 3000, 4000)]
    assert kinds == ["nothing", "nothing, dc", "nothing, rest", "nothing, dc"]
    assert {*kinds} < {*page.KINDS}


def test_the_rest_is_asked_for_by_its_own_count(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(strange, "go_through", lambda numbers, *of: asked.extend(numbers))
    monkeypatch.setattr(strange, "render", lambda entries: None)
    begin = ["strange", "--count", "0", "--origin", "a", "--rest", "2", "--dc-two", "1", "--dc"]
    monkeypatch.setattr("sys.argv", [*begin, "1"])
    assert strange.main() == 0
    monkeypatch.setattr("sys.argv", [*begin, "1001"])
    with pytest.raises(SystemExit):
        strange.main()
    assert "--dc: found 1001, expected at most 1000" in capsys.readouterr().err
    assert asked == [2000, 3000, 3001, 4000]


def test_a_draw_of_the_usual_causes_is_as_it_was():
    """From before there was a rest."""
    with short_recordings():
        one = draw.draw(15)
    assert one.truth == {"effect": "axis_skew", "location": "sensor",
                         "parameters": {"angle": pytest.approx(-0.014812657221446082, rel=1e-9)},
                         "E0": pytest.approx(8110.515207467756, rel=1e-6)}  # fmt: skip
    sums = [np.nansum(one.tables[n][c]) for n, c in ((0, "x"), (2, "y"))]
    assert sums == pytest.approx([-13.315807856935782, 8.767583794585244], rel=1e-9)


def test_a_case_of_the_rest_is_drawn_and_has_evidence(monkeypatch):
    """A detent's is beyond what its magnetic spring does."""
    detent = next(d for d in rest.REST if d.__name__ == "_detent_torque")
    monkeypatch.setattr(draw, "REST", (detent,))
    monkeypatch.setattr(draw, "NULLS", 0.0)
    monkeypatch.setattr(sizes, "FAINT", 50.0)
    monkeypatch.setattr(sizes, "TRIES", 2)
    with short_recordings():
        case = draw.drawn(3001, 3)
        found = case.found[0]
        assert case.truth["effect"] == "detent_torque"
        assert found.cause.without.beside.magnet.holding > 0
        left = evidence.evidence(case)[0]
    assert 0 < left <= 1.01 * found.evidence


@EACH
def test_every_size_lies_within_the_bounds_of_the_catalogue(draws):
    cause = draws(np.random.default_rng(1), about(1))
    bounds = {p.name: (p.lower, p.upper) for p in catalogue()[cause.name].parameters}
    assert cause.location in catalogue()[cause.name].locations
    for name, value in (pair for s in cause.bounds for pair in cause.parameters(s).items()):
        low, high = bounds[name]
        assert low * (1 - 1e-9) <= value <= high * (1 + 1e-9), name
