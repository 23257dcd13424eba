"""The compiled kernel against its Python reference, and what it must do on any machine."""

from dataclasses import replace

import numpy as np
import pytest
from kernel_helpers import (
    CHANNELS,
    STEP,
    assert_same,
    cases,
    drive,
    elementary,
    excitation,
    lively,
    polyline,
    run,
    start_values,
    vector,
)

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import (
    FREE_FORM_LOCATIONS,
    FREE_FORM_SIZE,
    LAW_KINDS,
    bundled_layout,
    free_form_vector,
)
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import load_machine
from corexy_fmi.simulate import machine_vector
from corexy_fmi.topology import FULL


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, marks=[] if c[2] == "full" else [pytest.mark.long]) for c in cases()],
    ids="-".join,
)
def test_reference_and_kernel_agree(case):
    name, location, fidelity, motors = case
    dc, effect = motors == "dc", catalogue()[name]
    values = vector("yin2018_dc" if dc else "yin2018")
    bare = run(excitation(dc), values, fidelity=fidelity, dc=dc, limit=STEP)
    first = bundled_layout().find(name, location).parameter
    values[first : first + len(effect.parameters)] = start_values(effect)
    found = assert_same(bundled_layout(), excitation(dc), values, fidelity=fidelity, dc=dc)
    if location.startswith("motor") and not dc and name == "periodic_disturbance":
        assert np.array_equal(found[:2], bare)  # a torque on a rotor that is held exactly
    else:
        assert np.abs(found[:2] - bare).max() > 1e-8, "the effect does nothing on this run"


@pytest.mark.parametrize("machine", ["light_bench", "gt2_printer"])
def test_reference_and_kernel_agree_on_other_machines(machine):
    values = vector(machine, [("stribeck_friction", "y", (2.0, 0.01))], belt_damping_time=2e-5)
    given = drive(*lively(40), radius=values[0])
    assert_same(bundled_layout(), given, values, limit=5e-5)


@pytest.mark.parametrize("motors", ["stepper", "dc"])
def test_smoothed_friction_agrees(motors):
    dc = motors == "dc"
    machine = "yin2018_dc" if dc else "yin2018"
    effects = [("stribeck_friction", "x", (2.0, 0.01))]
    values = vector(machine, effects, friction_smoothing=2e-3)
    found = assert_same(bundled_layout(), excitation(dc), values, dc=dc)
    assert np.abs(found[:2] - run(excitation(dc), vector(machine, effects), dc=dc)).max() > 1e-7


def test_all_effects_at_once_agree():
    every = [
        (e.name, location, start_values(e))
        for e in catalogue().values()
        for location in e.locations
    ]
    assert_same(bundled_layout(), excitation(rows=40), vector(effects=every))


def test_what_a_run_begins_with_agrees():
    rest = np.array([[2e-4, -1e-4, 0.7, -0.9, 0.0, 0.0]])
    found = run(excitation(), vector(), rest=rest, limit=STEP)
    slow = run_reference(bundled_layout(), excitation(), vector(), rest=rest[0], limit=STEP)
    assert np.abs(found - [slow["x"], slow["y"]]).max() < 1e-14
    still = run(excitation(), vector(), rest=rest * [0, 0, 1, 1, 0, 0], limit=STEP)
    assert np.abs((found - still)[:, 0] - rest[0, :2]).max() < 1e-16


def test_rotors_off_their_command_agree_and_are_held_by_their_friction():
    """The axes stand at the rotors; what a loop asks of them below their stiction moves nothing."""
    values, given = vector("yin2018_dc"), excitation(dc=True)
    given = replace(given, input1=0 * given.input1 + 1.0, input2=0 * given.input2 - 0.5)
    gain = load_machine("yin2018_dc").at("motor_torque_gain") * given.kp
    held = 0.5 * load_machine("yin2018_dc").at("pulley_coulomb_friction") / gain
    for off in (held, 100 * held):
        rest = np.array([[0.0, 0.0, 0.0, 0.0, off, -0.5 * off]])
        shown = ("x", "y", "phi1", "phi2")
        out = run(given, values, dc=True, rest=rest, channels=shown, limit=STEP)
        slow = run_reference(bundled_layout(), given, values, dc=True, rest=rest[0],
                             channels=shown, limit=STEP)  # fmt: skip
        assert np.abs(out - [slow[c] for c in shown]).max() < 1e-12
        angles = np.array([[1.0 + off], [-0.5 - 0.5 * off]])
        assert out[2:, :1] == pytest.approx(angles, abs=1e-15)
        radius = load_machine("yin2018_dc").parameters["pulley_radius"]
        x, y = radius * (angles[0] + angles[1]) / 2, radius * (angles[0] - angles[1]) / 2
        assert out[:2, :1] == pytest.approx(np.array([x, y]), abs=1e-15)
        assert (np.ptp(out[2]) == 0.0) == (off == held)


@pytest.mark.parametrize("held", [(1.0, 1.0), (-1.0, 0.5), (0.3, -1.0)])
def test_friction_holds_the_idlers_where_they_begin(held):
    """The most held idler's belt pulls by its share of the friction; none moves."""
    machine, still = load_machine("light_bench"), Excitation(*np.zeros((3, 400)))
    still = replace(still, time=np.arange(400) * 1e-3)
    sections = tuple(f"tension{n + 1}" for n in range(12))
    rows = FULL.rows(machine.parameters["pulley_radius"])[:, 4:]

    def pulls(rest):
        sets = machine_vector(machine)[None]
        out = run_lanes(bundled_layout(), still, sets, rest=np.array([rest]),
                        channels=(*sections, "x", "y"))[0, :, 1:]  # fmt: skip
        assert np.ptp(out, axis=1).max() < 1e-9
        return rows.T @ out[:12, 0]

    friction = machine.at("pulley_coulomb_friction")
    pull = np.abs(pulls((0.0, 0.0, *held, 0.0, 0.0)) - pulls(6 * (0.0,)))
    assert pull.max() == pytest.approx(friction * max(map(abs, held)))
    assert pulls(6 * (0.0,)) == pytest.approx(0.0, abs=1e-9)


def excitation_start(given, radius=5e-3):
    a, b = given.start()
    return np.array([a + b, a - b]) * radius / 2


def more_of(acts, argument):
    """What a law may have beside its knots and values: (viscous [s/m], onset [s])."""
    viscous, onsets = (0.0, 15.0) if acts == "friction" else (0.0,), (0.0, -0.03)
    return [(v, o) for v in viscous for o in (onsets if argument == "t" else onsets[:1])]


@pytest.mark.parametrize(
    ("acts", "location", "argument", "more"),
    [
        (acts, at, of, more)
        for at in FREE_FORM_LOCATIONS
        for acts, of in LAW_KINDS
        if acts == "force" or at in "xy"
        for more in more_of(acts, of)
    ],
)
def test_free_forms_agree(acts, location, argument, more):
    dc = location.startswith("motor")
    values = vector("yin2018_dc" if dc else "yin2018")
    width = {"v": 0.2, "x": 0.01, "y": 0.01, "p": 3.0, "t": 0.08}[argument[0]]
    knots = width * np.array([-1.0, -0.3, 0.0, 0.02, 0.5])
    first = bundled_layout().free_form + FREE_FORM_LOCATIONS.index(location) * FREE_FORM_SIZE
    heights = np.array([-1.0, 0.5, 0.2, 1.5, 0.7]) * (0.02 if dc else 3.0)
    law = free_form_vector(LAW_KINDS.index((acts, argument)), knots, heights, *more)
    values[first : first + FREE_FORM_SIZE] = law
    found = assert_same(bundled_layout(), excitation(dc, 60), values, dc=dc)
    bare = run(excitation(dc, 60), vector("yin2018_dc" if dc else "yin2018"), dc=dc, limit=STEP)
    assert np.abs(found[:2] - bare).max() > 1e-6


@pytest.mark.parametrize("mode", ["voltages", "closed_loop"])
@pytest.mark.parametrize("fidelity", ["full", "reduced"])
def test_dc_modes_agree(mode, fidelity):
    time, path = lively()
    volts = np.column_stack([np.sin(80 * time), np.cos(50 * time)])
    given = excitation(dc=True)
    if mode == "voltages":
        given = Excitation(time, *volts.T, "voltages", first_angles=(0.3, -0.2))
    found = assert_same(bundled_layout(), given, vector("yin2018_dc"), dc=True, fidelity=fidelity)
    if mode == "closed_loop":
        assert np.ptp(found[CHANNELS.index("V1")]) > 1.0
        assert np.abs(found[:2].T - path).max() < 8e-3


@pytest.mark.parametrize("delay", [1e-4, 3.3e-3, 0.05])
@pytest.mark.parametrize("limit", [STEP, 5e-5])
def test_delays_agree(delay, limit):
    values = vector(effects=[("sensor_delay", "sensor", (delay,))])
    assert_same(bundled_layout(), excitation(rows=70), values, limit=limit)


@pytest.mark.parametrize("machine", ["light_bench", "gt2_printer"])
def test_it_sticks_exactly(machine):
    """After a side, friction holds the carriage off its goal with a speed of exactly zero."""
    time, path = polyline([(0, 0), (0.02, 0)], 0.04, rest=1.5)
    values = vector(machine)
    x, vx = run(drive(time, path, values[0]), values, channels=("x", "vx"))
    late = time > time[-1] - 0.3
    assert (vx[late] == 0.0).all()
    assert np.ptp(x[late]) == 0.0
    assert abs(x[-1] - 0.02) > 1e-7


def test_nothing_moves_at_rest():
    still = Excitation(np.arange(50) * 1e-3, np.full(50, 0.3), np.full(50, -0.1))
    x, y = run(still, vector())
    assert np.ptp(x) == np.ptp(y) == 0.0


def test_shapes_are_checked():
    """The library reads as far as it is told to."""
    time = np.arange(5) * 1e-3
    with pytest.raises(ValueError, match="expected one number"):
        run(Excitation(time, time[:4], time), vector())
    with pytest.raises(ValueError, match="expected one number"):
        run(Excitation(time[:0], time[:0], time[:0]), vector())
    with pytest.raises(ValueError, match="parameters"):
        run(Excitation(time, time, time), vector()[:-1])
    with pytest.raises(ValueError, match=r"rest .*expected \(1, 6\)"):
        run(Excitation(time, time, time), vector(), rest=np.zeros((1, 2)))
    with pytest.raises(ValueError, match=r"inputs .*expected \(2, 1, 5\)"):
        run(Excitation(time, time, time), vector(), inputs=np.zeros((2, 5)))


def test_elementary_functions():
    x = np.concatenate(
        [np.linspace(-8, 8, 20001), np.random.default_rng(0).uniform(-3e3, 3e3, 20000)]
    )
    assert np.abs(elementary("sine")(x) - np.sin(x)).max() < 3e-16
    assert np.abs(elementary("cosine")(x) - np.cos(x)).max() < 3e-16
    y = np.random.default_rng(1).uniform(-700, 700, 20000)
    assert np.abs(elementary("exponential")(y) / np.exp(y) - 1).max() < 5e-16
    assert elementary("exponential")(np.array([-1e9]))[0] < 1e-300
    assert elementary("exponential")(np.array([0.0]))[0] == 1.0
