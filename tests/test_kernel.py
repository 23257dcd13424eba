"""The compiled kernel against its Python reference, its lanes against each other, its cache."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from kernel_helpers import (
    Probe,
    angles_of,
    cases,
    drive,
    elementary,
    lively,
    polyline,
    run,
    start_values,
    vector,
)
from own_effects import EVERY_PORT, LAG

from corexy_fmi.effects import catalogue, load_file
from corexy_fmi.effects.api import Law
from corexy_fmi.errors import InputError
from corexy_fmi.kernel import compiler
from corexy_fmi.kernel.call import OUTPUTS, Excitation, run_lanes, step_limit
from corexy_fmi.kernel.generate import generated_header
from corexy_fmi.kernel.layout import (
    FREE_FORM_ARGUMENTS,
    FREE_FORM_LOCATIONS,
    FREE_FORM_SIZE,
    KNOTS,
    bundled_layout,
    make_layout,
    nominal_index,
)
from corexy_fmi.kernel.pair_code import mirrored
from corexy_fmi.kernel.reference import run_reference
from corexy_fmi.machine import load_machine
from corexy_fmi.simulate import machine_vector, neutral_vector
from corexy_fmi.topology import FULL, STAGES

CHANNELS = ("x", "y", "vx", "vy", "ax", "ay", "phi1", "phi2", "x_true", "y_true", "V1", "V2")
STEP, SAME = 1.5e-4, 1e-9
LOOP = {"mode": "closed_loop", "kp": 20.0, "kd": 0.1}


def excitation(dc=False, rows=80):
    """A short run for either drive."""
    return drive(*lively(rows), **(LOOP if dc else {}))


def assert_same(layout, given, values, **options):
    """Kernel and reference agree in all channels, relative to the largest value of each."""
    options = {"channels": CHANNELS, "limit": STEP, **options}
    fast = run_lanes(layout, given, values[None], **options)[0]
    slow = run_reference(layout, given, values, **options)
    for name, found in zip(CHANNELS, fast, strict=True):
        size = np.abs(slow[name]).max()
        assert np.isfinite(found).all()
        assert np.abs(found - slow[name]).max() <= SAME * size, name
    return fast


@pytest.mark.parametrize("case", cases(), ids="-".join)
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
    rest = np.array([[2e-4, -1e-4, 0.7, -0.9]])
    found = run(excitation(), vector(), rest=rest, limit=STEP)
    slow = run_reference(bundled_layout(), excitation(), vector(), rest=rest[0], limit=STEP)
    assert np.abs(found - [slow["x"], slow["y"]]).max() < 1e-14
    still = run(excitation(), vector(), rest=rest * [0, 0, 1, 1], limit=STEP)
    assert np.abs((found - still)[:, 0] - rest[0, :2]).max() < 1e-16


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
    pull = np.abs(pulls((0.0, 0.0, *held)) - pulls((0.0, 0.0, 0.0, 0.0)))
    assert pull.max() == pytest.approx(friction * max(map(abs, held)))
    assert pulls((0.0, 0.0, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-9)


def excitation_start(given, radius=5e-3):
    a, b = given.start()
    return np.array([a + b, a - b]) * radius / 2


@pytest.mark.parametrize("argument", FREE_FORM_ARGUMENTS)
@pytest.mark.parametrize("location", FREE_FORM_LOCATIONS)
def test_free_forms_agree(location, argument):
    dc = location.startswith("motor")
    values = vector("yin2018_dc" if dc else "yin2018")
    width = {"v": 0.2, "x": 0.01, "y": 0.01, "p": 3.0, "t": 0.08}[argument[0]]
    knots = width * np.array([-1.0, -0.3, 0.0, 0.02, 0.5])
    first = bundled_layout().free_form + FREE_FORM_LOCATIONS.index(location) * FREE_FORM_SIZE
    values[first : first + 2] = FREE_FORM_ARGUMENTS.index(argument), len(knots)
    values[first + 2 : first + 2 + len(knots)] = knots
    heights = np.array([-1.0, 0.5, 0.2, 1.5, 0.7]) * (0.02 if dc else 3.0)
    values[first + 2 + KNOTS : first + 2 + KNOTS + len(knots)] = heights
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
    rest = np.linspace(-1, 1, 10)[:, None] * np.array([1e-4, -1e-4, 0.5, -1.0])
    sets = np.tile(vector(), (10, 1))
    together = run_lanes(bundled_layout(), excitation(), sets, rest=rest)
    for n in (0, 7, 8, 9):
        alone = run(excitation(), vector(), rest=rest[n : n + 1])
        assert np.array_equal(alone, together[n])


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
    damped = vector(belt_damping_time=1e-2)
    assert step_limit(layout, damped) < step_limit(layout, vector()) / 10
    mismatch = vector("gt2_printer", [("belt_mismatch", "belts", (2.0,))])
    assert step_limit(layout, mismatch) < base


@pytest.mark.parametrize("machine", ["yin2018", "light_bench", "gt2_printer"])
def test_the_automatic_step_is_stable_at_the_bounds(machine):
    """Every effect at the ends of its ranges, damped belts, light idlers: nothing blows up."""
    sets = [vector(machine, belt_damping_time=t) for t in (1e-3, 5e-3)]
    sets += [vector(machine, pulley_inertia=1e-8), vector(machine, pulley_viscous_friction=2e-3)]
    for name, location, _, _ in cases(("full",), ("stepper",)):
        if not location.startswith("pulley"):
            ends = [(p.lower, p.upper) for p in catalogue()[name].parameters]
            sets += [vector(machine, [(name, location, e)]) for e in zip(*ends, strict=True)]
    given = drive(*lively(60), radius=sets[0][0])
    for values in sets:
        assert np.abs(run(given, values)).max() < 0.25  # pulses of 1 kN push it by 0.2 m


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
    with pytest.raises(ValueError, match=r"rest .*expected \(1, 4\)"):
        run(Excitation(time, time, time), vector(), rest=np.zeros((1, 2)))


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


@pytest.mark.parametrize("text", [LAG, EVERY_PORT], ids=["lag", "every_port"])
def test_an_effect_of_ones_own_touches_no_other_file(tmp_path, text):
    file = tmp_path / "my_effect.py"
    file.write_text(text)
    effect = load_file(file)
    layout = make_layout({**catalogue(), effect.name: effect})
    bare = neutral_vector(layout)
    for location in effect.locations:
        values = bare.copy()
        values[layout.find(effect.name, location).parameter] = 0.01
        found = assert_same(layout, excitation(), values)
        reference = run_lanes(layout, excitation(), bare[None], limit=STEP)[0]
        assert np.abs(found[:2] - reference).max() > 1e-6


def test_own_lag_obeys_its_equation(tmp_path):
    """x_m = x - T v behind a ramp, once the start has faded."""
    (tmp_path / "lag.py").write_text(LAG)
    effect = load_file(tmp_path / "lag.py")
    layout = make_layout({effect.name: effect})
    values = neutral_vector(layout)
    values[layout.find("my_lag", "sensor").parameter] = 0.01
    time = np.arange(500) * 1e-3
    given = drive(time, np.column_stack([0.05 * time, 0 * time]))
    x, true = run_lanes(layout, given, values[None], channels=("x", "x_true"))[0]
    assert x[-1] == pytest.approx(true[-1] - 0.01 * 0.05, abs=0.05 * 2e-4)


BROKEN = {
    "reads nothing known": ("guide", lambda nonsense: {"bound": nonsense}, "reads nonsense"),
    "may not write": ("guide", lambda velocity: {"velocity": velocity}, "may not write velocity"),
    "may not remember": ("sensor", lambda x: {"seat": x}, "may not remember seat"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_wrong_law_is_refused(kind):
    port, function, words = BROKEN[kind]
    function.__name__ = "broken"
    effect = replace(catalogue()["backlash"], laws=(Law(port, function),))
    with pytest.raises(ValueError, match=words):
        generated_header(make_layout({"backlash": effect}))


@pytest.mark.parametrize("name", ["step", "double", "pull", "two words", "t_1"])
def test_a_taken_name_is_refused(name):
    """A memory called like a variable of the port would silently read the wrong one."""
    effect = replace(catalogue()["backlash"], memory=(name,))
    with pytest.raises(ValueError, match=f"'{name}' is taken"):
        generated_header(make_layout({"backlash": effect}))


@pytest.mark.parametrize("text", ["EFFECT = 3", "import nonsense_that_is_not_there", "def ("])
def test_a_file_that_is_no_effect(tmp_path, text):
    (tmp_path / "no.py").write_text(text)
    with pytest.raises(InputError, match=r"no\.py"):
        load_file(tmp_path / "no.py")


BUILD = """
from corexy_fmi.kernel.compiler import kernel_library
from corexy_fmi.kernel.layout import make_layout
print(kernel_library(make_layout({}), 1))
"""


def test_two_builds_at_once_end_with_one_file(tmp_path, monkeypatch):
    monkeypatch.setenv("COREXY_CACHE", str(tmp_path))
    builds = [
        subprocess.Popen([sys.executable, "-c", BUILD], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    answers = {build.communicate(timeout=120)[0].strip() for build in builds}
    assert [build.returncode for build in builds] == [0, 0]
    assert answers == {str(path) for path in tmp_path.iterdir()}


def test_cache_key_knows_what_decides_the_bytes(monkeypatch):
    layout = make_layout({})
    keys = {compiler._fingerprint(layout, 1), compiler._fingerprint(layout, 8)}
    keys.add(compiler._fingerprint(bundled_layout(), 1))
    monkeypatch.setattr(compiler, "FLAGS", (*compiler.FLAGS, "-DNOTHING"))
    keys.add(compiler._fingerprint(layout, 1))
    monkeypatch.undo()
    monkeypatch.setattr(compiler, "native_flags", lambda lanes: ("-march=x86-64",))
    keys.add(compiler._fingerprint(layout, 1))
    monkeypatch.undo()
    monkeypatch.setattr(compiler, "cpu_name", lambda: "another")
    keys.add(compiler._fingerprint(layout, 1))
    monkeypatch.undo()
    assert len(keys) == 6
    assert compiler._fingerprint(layout, 1) in keys


def test_without_a_compiler_the_line_that_installs_one(monkeypatch):
    compiler.find_compiler.cache_clear()
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"install gcc, or the wheel 'ziglang'"):
        compiler.find_compiler()
    compiler.find_compiler.cache_clear()
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: object())
    assert compiler.find_compiler()[1:] == ("-m", "ziglang", "cc")
    compiler.find_compiler.cache_clear()


def test_a_failing_compiler_is_told(tmp_path):
    (tmp_path / "bad.c").write_text("int nonsense(")
    with pytest.raises(InputError, match="the C compiler failed"):
        compiler.compile_library([tmp_path / "bad.c"], tmp_path / "bad.so")
    assert [path.name for path in tmp_path.iterdir()] == ["bad.c"]


def test_portable_flags_give_the_same_bits():
    """The FMU is built without the CPU's own instructions: nothing may be contracted."""
    time, path = lively(60)
    probe, angles = Probe(vector()), angles_of(path)
    for n in range(len(time) - 1):
        probe.drive(rates=(angles[n + 1] - angles[n]) / (time[n + 1] - time[n]))
        probe.advance(time[n + 1] - time[n], STEP)
    x, y = run(drive(time, path), vector(), limit=STEP)
    assert probe.get()[0][:2] == pytest.approx([x[-1], y[-1]], abs=1e-15)
