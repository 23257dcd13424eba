"""Lanes, registers and steps of the kernel: the same bits, however many sets run at once."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from kernel_helpers import (
    CHANNELS,
    STEP,
    Probe,
    angles_of,
    cases,
    drive,
    excitation,
    lively,
    run,
    start_values,
    vector,
)

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import OUTPUTS, run_lanes, step_limit
from corexy_fmi.kernel.layout import (
    bundled_layout,
    make_layout,
    nominal_index,
)
from corexy_fmi.kernel.pair_code import mirrored
from corexy_fmi.simulate import neutral_vector
from corexy_fmi.topology import FULL, STAGES


def mixed_lanes():
    """Twelve sets: bare, and each effect somewhere, so that lanes of a block differ."""
    sets = [vector()]
    for name, location, _, _ in cases(("full",), ("stepper",)):
        if not location.startswith("pulley") and location not in ("motor2", "motors", "xy"):
            sets.append(vector(effects=[(name, location, start_values(catalogue()[name]))]))
    return np.array(sets)


def test_lanes_equal_single_runs_bit_for_bit():
    """A lane does not see what is on in its neighbours."""
    sets = mixed_lanes()
    assert len(sets) > 8
    options = {"limit": STEP, "channels": (*CHANNELS, "torque1", "tension3")}
    together = run_lanes(bundled_layout(), excitation(), sets, **options)
    for values, lane in zip(sets, together, strict=True):
        alone = run_lanes(bundled_layout(), excitation(), values[None], **options)[0]
        assert np.array_equal(alone, lane)


@pytest.mark.parametrize("fidelity", ["full", "reduced", "condensed"])
@pytest.mark.parametrize("limit", [2e-3, 2.5e-4, 7e-5])
def test_steps_in_registers_equal_steps_one_by_one(fidelity, limit):
    """Eight lanes keep a variable in a register, one lane both belts' variables."""
    vector = neutral_vector(bundled_layout())[None]
    alone, lanes = (
        run_lanes(
            bundled_layout(), excitation(), np.repeat(vector, n, axis=0),
            fidelity=fidelity, limit=limit, channels=OUTPUTS,
        )
        for n in (1, 8)
    )  # fmt: skip
    assert np.array_equal(alone[0], lanes[7])


@pytest.mark.parametrize("machine", ["yin2018", "gt2_printer"])
@pytest.mark.parametrize("fidelity", ["full", "reduced", "condensed"])
@pytest.mark.parametrize("sets", [1, 8, 11])
@pytest.mark.parametrize("rows", ["even", "uneven"])
def test_rows_at_once_equal_rows_one_by_one(machine, fidelity, sets, rows):
    """Of positions and speeds alone all rows run at once; other outputs are asked for at each."""
    random = np.random.default_rng(3)
    vectors = np.tile(vector(machine), (sets, 1))
    vectors[:, nominal_index("carriage_mass")] *= random.uniform(0.8, 1.2, sets)
    time, path = lively(60)
    if rows == "uneven":
        time = np.cumsum(random.uniform(5e-5, 3e-3, len(time)))
    given = drive(time, path, radius=vectors[0, 0])
    names = ("x", "y", "vx", "vy", "x_true")
    at_once, one_by_one = (
        run_lanes(bundled_layout(), given, vectors, fidelity=fidelity, limit=STEP, channels=c)
        for c in (names, OUTPUTS)
    )
    kept = [OUTPUTS.index(name) for name in names]
    assert np.array_equal(at_once, one_by_one[:, kept])
    assert np.ptp(at_once[:, 0], axis=1).min() > 1e-3


def test_what_is_read_only_is_read():
    values = vector()[None]
    values.flags.writeable = False
    assert np.array_equal(run(excitation(), values), run(excitation(), values.copy()))


def test_two_belts_in_one_register_where_they_mirror_each_other():
    assert [name for name, stage in STAGES.items() if mirrored(stage)] == ["full"]
    two = FULL.sections[6]
    turned = replace(two, row={c: -w for c, w in two.row.items()})
    assert not mirrored(replace(FULL, sections=(*FULL.sections[:6], turned, *FULL.sections[7:])))
    assert not mirrored(replace(FULL, sections=FULL.sections[:-1]))


def test_lanes_take_their_own_rest():
    rest = np.linspace(-1, 1, 10)[:, None] * np.array([1e-4, -1e-4, 0.5, -1.0, 0.0, 0.0])
    sets = np.tile(vector(), (10, 1))
    together = run_lanes(bundled_layout(), excitation(), sets, rest=rest)
    for n in (0, 7, 8, 9):
        alone = run(excitation(), vector(), rest=rest[n : n + 1])
        assert np.array_equal(alone, together[n])


@pytest.mark.parametrize("sets", [1, 10])
@pytest.mark.parametrize("lead", [0.0, 0.02])
@pytest.mark.parametrize(
    ("fidelity", "mode"),
    [
        *product(("full", "reduced"), ("swept", "angles", "closed_loop", "voltages")),
        *product(("kinematic",), ("swept", "angles")),
    ],
)
def test_lanes_take_their_own_inputs(fidelity, mode, lead, sets):
    """Swept, row by row where a hook runs, in a loop, from volts; at rest and moving at first."""
    dc = mode not in ("swept", "angles")
    lag = ("sensor_lag", "sensor", start_values(catalogue()["sensor_lag"]))
    hook = [lag] if mode == "angles" else []
    given = replace(excitation(dc), lead=lead, mode="angles" if not dc else mode)
    course = np.array([given.input1, given.input2])[:, None]
    inputs = course * np.linspace(0.5, 1.5, sets)[:, None] + np.linspace(0, 0.1, sets)[:, None]
    vectors, options = np.tile(vector(effects=hook), (sets, 1)), {"fidelity": fidelity, "dc": dc}
    together = run_lanes(bundled_layout(), given, vectors, inputs=inputs, limit=STEP, **options)
    for n in range(sets):
        own = replace(given, input1=inputs[0, n], input2=inputs[1, n])
        alone = run_lanes(bundled_layout(), own, vectors[:1], limit=STEP, **options)[0]
        assert np.array_equal(alone, together[n])
    assert sets == 1 or not np.array_equal(together[0], together[-1])


@pytest.mark.parametrize("fidelity", ["full", "reduced"])
@pytest.mark.parametrize("law", [None, "constant_force", "friction_vs_position", "quadratic_drag"])
def test_lanes_take_their_own_rounding_of_friction(law, fidelity):
    """In registers, and where a law adds force, changes the bound, or the damping of an axis."""
    hook = [(law, "x", start_values(catalogue()[law]))] if law else []
    widths = np.array([0.0, 1e-5, 2e-4, 2e-3, 0.0, 3e-4, 1e-3, 5e-5, 4e-4, 1e-6])
    vectors = np.array([vector(effects=hook, friction_smoothing=w) for w in widths])
    options = {"fidelity": fidelity, "limit": STEP}
    together = run_lanes(bundled_layout(), excitation(False), vectors, **options)
    for n, one in enumerate(vectors):
        alone = run_lanes(bundled_layout(), excitation(False), one[None], **options)[0]
        assert np.array_equal(alone, together[n])
    assert not np.array_equal(together[0], together[3])


def test_neutral_effects_leave_bits_and_step():
    """Other parameters of an effect that is off do not matter either."""
    bare, layout = vector(), bundled_layout()
    other = bare.copy()
    for instance in layout.instances:
        for k, parameter in enumerate(instance.effect.parameters):
            if not parameter.size:
                other[instance.parameter + k] = parameter.starts[0]
    assert not np.array_equal(bare, other)
    assert step_limit(layout, bare) == step_limit(layout, other)
    assert np.array_equal(run(excitation(), bare), run(excitation(), other))


def test_a_layout_without_effects_gives_the_same_bits():
    empty = make_layout({})
    found = run_lanes(empty, excitation(), neutral_vector(empty)[None])[0]
    assert np.array_equal(found, run(excitation(), neutral_vector(bundled_layout())))


def test_step_follows_the_fastest_pole():
    layout, base = bundled_layout(), step_limit(bundled_layout(), vector("gt2_printer"))
    stiff = vector("gt2_printer", belt_axial_stiffness=4 * 19400 * 4)
    assert step_limit(layout, stiff) == pytest.approx(base / 4, rel=0.2)
    tool = vector(effects=[("tool_mode", "tool", (0.5, 400.0, 0.02))])
    assert step_limit(layout, tool) < 0.75 / (2 * np.pi * 400 * np.sqrt(6)) * 1.01
    rotor = vector(effects=[("stepper_compliance", "motors", (5.0, 0.0))])
    assert step_limit(layout, rotor) <= 0.75 / np.sqrt(50 * 5.0 / 5.4e-6) * 1.0001
    own = step_limit(layout, vector())
    assert step_limit(layout, vector(belt_damping_time=1e-2)) < own / 10
    damping, slack = ("belt_damping", "belts", (1e-2,)), ("belt_slack", "belts", (5.0, 0.0))
    assert own / 4 < step_limit(layout, vector(effects=[damping])) < own  # idlers are tied
    assert step_limit(layout, vector(effects=[damping, slack])) < own / 10
    mismatch = vector("gt2_printer", [("belt_mismatch", "belts", (2.0,))])
    assert step_limit(layout, mismatch) < base


@pytest.mark.parametrize("machine", ["yin2018", "light_bench", "gt2_printer"])
def test_the_automatic_step_is_stable_at_the_bounds(machine):
    """Every effect at the ends of its ranges, damped belts, light idlers: nothing blows up.

    Pulses push with 1 kN, a cable pulls with 14.
    """
    pulled: list[np.ndarray] = []
    sets = [vector(machine, belt_damping_time=t) for t in (1e-3, 5e-3)]
    sets += [vector(machine, pulley_inertia=1e-8), vector(machine, pulley_viscous_friction=2e-3)]
    for name, location, _, _ in cases(("full",), ("stepper",)):
        if not location.startswith("pulley"):
            ends = [(p.lower, p.upper) for p in catalogue()[name].parameters]
            found = [vector(machine, [(name, location, e)]) for e in zip(*ends, strict=True)]
            (pulled if name == "cable_drag" else sets).extend(found)
    given = drive(*lively(60), radius=sets[0][0])
    assert all(np.abs(run(given, values)).max() < 0.5 for values in sets)
    assert all(np.abs(run(given, values)).max() < 5.0 for values in pulled)


def test_step_count_is_never_rounded():
    """Rows at any distance: n = ceil(h / limit) steps, and time does not drift."""
    rng = np.random.default_rng(0)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(2e-5, 3e-3, 60))])
    path = np.column_stack([0.04 * time, 0.02 * time])
    even = np.linspace(0, time[-1], 4000)
    fine = run(drive(even, np.column_stack([0.04 * even, 0.02 * even])), vector(), limit=1e-5)
    coarse = run(drive(time, path), vector())
    for found, exact in zip(coarse, fine, strict=True):
        assert np.abs(found - np.interp(time, even, exact)).max() < 2e-7


def test_portable_flags_give_the_same_bits():
    """The FMU is built without the CPU's own instructions: nothing may be contracted."""
    time, path = lively(60)
    probe, angles = Probe(vector()), angles_of(path)
    for n in range(len(time) - 1):
        probe.drive(rates=(angles[n + 1] - angles[n]) / (time[n + 1] - time[n]))
        probe.advance(time[n + 1] - time[n], STEP)
    x, y = run(drive(time, path), vector(), limit=STEP)
    assert probe.get()[0][:2] == pytest.approx([x[-1], y[-1]], abs=1e-15)
