"""The other 25 effects of the plant: nothing at size zero, at their place alone, and what closed
forms say of each."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from plant.bends import tension
from plant.layout import SLOT
from plant.machines import base, pack
from plant.more import FULL, MORE
from plant.motions import STEP, draw_motion
from plant.planted import Planted
from plant.recording import Run, channels, trajectory

NAMED = {e.name: e for e in FULL}
INVERSE = {"presliding_hysteresis", "belt_slack", "supply_saturation", "racking", "frame_mode"}
SHARP = {"belt_slack", "supply_saturation"}  # no effect at all up to some size
NEW = [(e, where, drive) for e in MORE for drive in e.drives for where in e.places(drive)]
IDS = [f"{e.name}-{where}-{drive}" for e, where, drive in NEW]
# no dry friction, and little of any other kind: x and y are decoupled springs
EASY = {
    "carriage_coulomb_friction": 0.0,
    "bridge_coulomb_friction": 0.0,
    "pulley_coulomb_friction": 0.0,
    "pulley_viscous_friction": 1e-7,
    "carriage_viscous_friction": 15.0,
    "bridge_viscous_friction": 15.0,
}
KE = 4795.0  # section stiffness of yin2018 from a motor to the end-effector, PHYSICS 4 [N/m]
SPRING = 2.0 * KE  # on x and on y, motors held
R = 5e-3


def machine(name="yin2018", drive="stepper", **changed):
    return base(name, drive) | changed


def run_to(x, y, **own):
    """Follows a path in x, y [m]."""
    ref = np.column_stack([np.add(x, y), np.subtract(x, y)]) / R
    return Run(ref, (0.0, 0.0), 0.0, np.zeros_like(ref), 1, **own)


def resting(seconds, **own):
    return run_to(np.zeros(round(seconds / STEP)), 0.0, **own)


def ramp(speed, seconds, across=0.0, **own):
    t = np.arange(0.0, seconds, STEP)
    return run_to(speed * t - 0.02, across * t, **own)


def slots(name, where, parameters, **form):
    return NAMED[name].slots(where, parameters, form)


def shown(values, run, more=None, drive="stepper"):
    return channels(pack(values, drive, more), run)


def moved(name, drive, seed=3):
    """A motion of many kinds on the light machine."""
    values = machine("light_bench", drive)
    ref = draw_motion(np.random.default_rng(seed), "commissioning", "light_bench", values, 1.5)
    own = {"phase": 0.4, "lost_at": 0.7}
    return values, Run(ref, (0.0, 0.0), 0.0, np.zeros_like(ref), 1, **own)


def away(one, other):
    return max(float(np.abs(one[axis] - other[axis]).max()) for axis in "xy")


@pytest.mark.parametrize(("entry", "where", "drive"), NEW, ids=IDS)
def test_nothing_at_size_zero_and_something_at_its_size(entry, where, drive):
    values, run = moved(entry.name, drive)
    rng = np.random.default_rng(5)
    shape, form = entry.shape(rng), entry.form(rng, drive)
    plain = shown(values, run, drive=drive)

    def at(size):
        one = Planted(entry, where, size, shape, form)
        return away(shown(values, run, one.slots(), drive), plain)

    middle = entry.bounds[1] if entry.name in SHARP else np.sqrt(np.prod(entry.bounds))
    here = at(middle)
    assert 1e-10 < here < 5e-2
    if entry.name == "presliding_hysteresis":  # Coulomb's friction, in the limit
        assert at(1e-8) < 0.03 * here
    elif entry.name == "racking":
        assert at(entry.bounds[0]) < 0.05 * here
    elif entry.name in INVERSE:
        assert at(1e-7 * entry.bounds[0]) < 1e-4 * here
    else:
        assert at(0.0) < 1e-12


@pytest.mark.parametrize(
    "name",
    ["presliding_hysteresis", "quadratic_drag", "friction_warmup", "cable_drag",
     "friction_vs_position", "periodic_disturbance"],
)  # fmt: skip
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_law_of_one_axis_leaves_the_other_alone(name, axis):
    entry, rng = NAMED[name], np.random.default_rng(1)
    values = machine(pulley_coulomb_friction=0.0)
    t = np.arange(0.0, 1.0, STEP)
    run = run_to(0.01 * np.sin(7 * t), 0.01 * np.sin(5 * t))
    one = Planted(entry, axis, np.sqrt(np.prod(entry.bounds)), entry.shape(rng), {})
    out, plain = shown(values, run, one.slots()), shown(values, run)
    other = "y" if axis == "x" else "x"
    apart = {n: np.abs(out[n] - plain[n]).max() for n in "xy"}
    assert apart[axis] > 1e-7
    assert apart[other] < 0.01 * apart[axis]  # the instants at which events are located


@pytest.mark.parametrize(
    ("name", "drive", "one", "other"),
    [
        ("tooth_ripple", "stepper", {"amplitude": 1e-5, "teeth": 16, "phase": 0.7},
         {"phase": -0.7}),
        ("microstep_error", "stepper", {"amplitude": 1e-3, "phase": 0.7}, {"phase": -0.7}),
        ("missed_steps", "stepper", {"steps": 2}, {"steps": -2}),
        ("periodic_disturbance", "dc", {"amplitude": 1e-3, "frequency": 4.0, "phase": 0.7},
         {"phase": 0.7 + np.pi}),
    ],
)  # fmt: skip
def test_motor_1_is_the_mirror_image_of_motor_2(name, drive, one, other):
    values, run = moved(name, drive)
    mirrored = Run(-run.ref[:, ::-1], *((0.0, 0.0), 0.0, np.zeros_like(run.ref), 1))
    run = Run(run.ref, (0.0, 0.0), 0.0, np.zeros_like(run.ref), 1)
    a = shown(values, run, slots(name, "motor1", one), drive)
    b = shown(values, mirrored, slots(name, "motor2", one | other), drive)
    assert away({"x": -b["x"], "y": b["y"]}, a) < 1e-9
    assert away(a, shown(values, run, drive=drive)) > 1e-6


def test_a_slow_force_moves_the_stage_by_its_compliance():
    beat = {"amplitude": 0.5, "frequency": 2.0, "phase": 0.0}
    for axis in "xy":
        x = shown(machine(**EASY), resting(2.0), slots("periodic_disturbance", axis, beat))[axis]
        assert np.ptp(x[1000:]) / 2 == pytest.approx(0.5 / SPRING, rel=0.02)


def test_pulses_have_their_amplitude_and_duty():
    beat = {"amplitude": 0.5, "frequency": 2.0, "phase": 0.0}
    more = slots("periodic_disturbance", "x", beat, duty=0.3)
    values = machine(**EASY | {"carriage_viscous_friction": 90.0})
    x = shown(values, resting(2.0), more)["x"][1000:]
    assert np.ptp(x) / 2 == pytest.approx(0.5 / SPRING, rel=0.03)
    assert np.mean(x > 0.5 / SPRING) == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_drag_lags_by_its_force_over_the_stiffness(form):
    values, run, v = machine(**EASY), ramp(0.05, 1.0), 0.05
    more = slots("quadratic_drag", "x", {"coefficient": 100.0}, law=form)
    lag = shown(values, run)["x"][-2] - shown(values, run, more)["x"][-2]
    low = 0.01 * form
    assert lag == pytest.approx(100.0 * v * (np.hypot(v, low) - low) / SPRING, rel=1e-3)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_a_tight_spot_lags_most_at_its_centre(form):
    values, run = machine(**EASY), ramp(0.02, 2.0)
    more = slots(
        "friction_vs_position", "x", {"extra": 0.5, "center": 0.003, "width": 5e-3}, law=form
    )
    plain = shown(values, run)["x"]
    lag = plain - shown(values, run, more)["x"]
    assert lag.max() == pytest.approx(0.5 / SPRING, rel=0.02)
    assert plain[lag.argmax()] == pytest.approx(0.003, abs=5e-4)
    wide = plain[lag > 0.5 * lag.max()]
    assert np.ptp(wide) == pytest.approx(2.355 * 5e-3, rel=0.05)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_friction_grows_with_the_belts_load(form):
    values, run = machine(**EASY, bridge_mass=0.2), ramp(0.02, 1.0, across=0.04)
    plain = shown(values, run)
    ideal = run.ref @ np.array([[1.0, 1.0], [1.0, -1.0]]) * R / 2
    pull = SPRING * (ideal[-2] - [plain["x"][-2], plain["y"][-2]])
    out = shown(values, run, slots("load_friction", "x", {"coefficient": 0.1}, law=form))
    lag = plain["x"][-2] - out["x"][-2]
    if form == 1.0:
        assert lag == pytest.approx(0.1 * pull[1] / SPRING, rel=1e-3)
    else:
        total = np.hypot(pull[0] + SPRING * lag, pull[1])
        assert lag == pytest.approx(0.1 * total / SPRING, rel=1e-2)


def test_a_warm_up_fades_from_its_onset():
    values, run = machine(**EASY | {"carriage_coulomb_friction": 0.2}), ramp(0.02, 2.0, onset=0.5)
    more = slots("friction_warmup", "x", {"extra_ratio": 2.0, "time_constant": 0.7})
    lag = shown(values, run)["x"] - shown(values, run, more)["x"]
    for t in (0.3, 1.0, 1.8):
        left = np.exp(-max(t - 0.5, 0.0) / 0.7)
        assert lag[round(t / STEP)] == pytest.approx(0.4 * left / SPRING, rel=0.02)


@pytest.mark.parametrize("form", [0.0, 1.0, 2.0])
def test_bristles_are_a_spring_at_first_and_coulomb_in_sliding(form):
    values = machine(**EASY | {"carriage_coulomb_friction": 0.5})
    bristles = slots("presliding_hysteresis", "x", {"stiffness": 2e4}, law=form)
    beat = slots("periodic_disturbance", "x", {"amplitude": 5e-3, "frequency": 2.0, "phase": 0.0})
    x = shown(values, resting(2.0), bristles | beat)["x"][1000:]
    assert np.ptp(x) / 2 == pytest.approx(5e-3 / (SPRING + 2e4), rel=0.02)
    run = ramp(0.05, 1.0)
    assert shown(values, run, bristles)["x"][-2] == pytest.approx(
        shown(values, run)["x"][-2], abs=1e-7
    )


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_a_slack_section_never_pushes(form):
    w = pack(machine(), "stepper", slots("belt_slack", "belts", {"pretension": 2.0}, law=form))
    left = [tension(w, 5000.0, e) + 2.0 for e in np.linspace(-5e-3, 5e-3, 101)]
    assert min(left) >= 0.0
    assert np.all(np.diff(left) >= 0.0)
    assert left[-1] == pytest.approx(27.0)
    assert tension(w, 5000.0, 0.0) == pytest.approx(0.0, abs=2e-5)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_hardening_is_the_growth_of_stiffness_with_strain(form):
    w = pack(
        machine(), "stepper", slots("belt_hardening", "belts", {"coefficient": 20.0}, law=form)
    )
    h, k = 1e-7, 5000.0
    for strain in (-1e-3, 0.0, 1e-3):
        e = strain * w[SLOT["belt_axial_stiffness"]] / k
        slope = (tension(w, k, e + h) - tension(w, k, e - h)) / (2 * h)
        assert slope == pytest.approx(k * (1.0 + 20.0 * strain), rel=3e-4)


def test_a_belt_creeps_from_its_stiffness_at_once_to_that_in_the_end():
    push = slots(
        "periodic_disturbance", "x", {"amplitude": 1.0, "frequency": 0.0, "phase": np.pi / 2}
    )
    creep = slots("belt_relaxation", "belts", {"ratio": 0.5, "time_constant": 0.2})
    x = shown(machine(**EASY), resting(2.5), push | creep)["x"]
    for t in (0.1, 0.3, 2.4):
        wanted = 1.0 - 0.5 / 1.5 * np.exp(-t / (0.2 * 1.5))
        assert x[round(t / STEP)] * SPRING == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_belt_damping_is_drag_against_the_motors(form):
    push = slots("periodic_disturbance", "x", {"amplitude": 1.0, "frequency": 3.0, "phase": 0.0})
    damped = shown(
        machine(**EASY),
        resting(1.0),
        push | slots("belt_damping", "belts", {"time": 4e-3}, law=form),
    )
    drag = machine(**EASY | {"carriage_viscous_friction": 15.0 + 4e-3 * SPRING})
    late = damped["x"] - shown(drag, resting(1.0), push)["x"]
    assert np.abs(late[500:]).max() < 0.02 / SPRING


def test_zeners_arm_damps_what_belts_swing_at():
    """At 40 Hz it is a dashpot still, within what its lag of 0.1 rad makes."""
    push = slots("periodic_disturbance", "x", {"amplitude": 1.0, "frequency": 40.0, "phase": 0.0})
    bare = shown(machine(**EASY), resting(1.0), push)["x"]
    two = [
        shown(
            machine(**EASY),
            resting(1.0),
            push | slots("belt_damping", "belts", {"time": 4e-4}, law=form),
        )["x"]
        for form in (0.0, 1.0)
    ]
    apart, change = np.std(two[1] - two[0]), np.std(two[0] - bare)
    assert apart < 0.15 * change


def test_a_tooth_error_moves_both_axes_by_half():
    amplitude = 1e-5
    more = slots("tooth_ripple", "motor1", {"amplitude": amplitude, "teeth": 16, "phase": 0.0})
    run = ramp(0.004, 3.0)
    out, plain = shown(machine(**EASY), run, more), shown(machine(**EASY), run)
    for axis in "xy":
        assert np.ptp((out[axis] - plain[axis])[500:]) / 2 == pytest.approx(amplitude / 2, rel=0.03)


def test_cogging_holds_a_rotor_where_spring_and_torque_balance():
    torque, phase, run = 0.02, 0.6, resting(0.5)
    more = slots("detent_torque", "motors", {"torque": torque, "phase": phase}, holding=0.4)
    q = trajectory(pack(machine(), "stepper", more), run)[0]
    for i in (2, 3):
        pull = 0.4 * np.sin(50 * q[0, i]) + torque * np.sin(200 * q[0, i] + phase)
        assert pull == pytest.approx(0.0, abs=1e-9)
        assert abs(q[0, i]) > 1e-4
        assert q[-1, i] == pytest.approx(q[0, i], abs=1e-6)


def test_missed_steps_shift_the_stage_for_good():
    for where, sign in (("motor1", -1.0), ("motor2", 1.0)):
        run = resting(1.0, lost_at=0.4, times_lost=2)
        out = shown(machine(**EASY), run, slots("missed_steps", where, {"steps": 3}))
        assert out["x"][390] == 0.0
        assert out["x"][-1] == pytest.approx(-6 * np.radians(1.8) * R / 2, rel=5e-3)
        assert out["y"][-1] == pytest.approx(sign * 6 * np.radians(1.8) * R / 2, rel=5e-3)


def test_a_microstep_error_follows_the_electrical_cycle():
    run = ramp(0.002, 3.0)
    more = slots("microstep_error", "motor1", {"amplitude": 2e-3, "phase": 0.3})
    out, plain = shown(machine(**EASY), run, more), shown(machine(**EASY), run)
    wanted = 2e-3 * (np.sin(50 * run.ref[:, 0] + 0.3) - np.sin(0.3)) * R / 2
    assert (out["x"] - plain["x"])[200:] == pytest.approx(wanted[200:], abs=0.05 * 2e-3 * R / 2)


@pytest.mark.parametrize("form", [0.0, 1.0])
def test_a_filtered_ramp_is_late_by_its_time_constant(form):
    run, tau = ramp(0.05, 0.6), 0.02
    out = shown(
        machine(**EASY), run, slots("sensor_lag", "sensor", {"time_constant": tau}, law=form)
    )
    late = shown(machine(**EASY), run)["x"][-2] - out["x"][-2]
    assert late == pytest.approx(0.05 * tau, rel=1e-4)


def test_what_a_sensor_does_to_positions():
    _, run = moved("", "stepper")
    plain = shown(machine(), run)
    x, y = plain["x"], plain["y"]
    turned = shown(machine(), run, slots("sensor_rotation", "sensor", {"angle": 0.01}))
    assert away(turned, {"x": x - 0.01 * y, "y": y + 0.01 * x}) < 1e-15
    gains = {"scale_x": 1.02, "scale_y": 0.99}
    scaled = shown(machine(), run, slots("sensor_scale", "sensor", gains))
    assert away(scaled, {"x": 1.02 * x, "y": 0.99 * y}) < 1e-15
    drifted = shown(machine(), run, slots("clock_drift", "sensor", {"ratio": -0.01}))
    when = run.time * 0.99
    assert away(drifted, {n: np.interp(when, run.time, plain[n]) for n in "xy"}) < 2e-6


def test_a_bridge_yaws_in_motion_along_x_only():
    more = slots("racking", "bridge", {"stiffness": 50.0, "inertia": 1e-3})
    t = np.arange(0.0, 0.5, STEP)
    along_x, along_y = run_to(0.01 * np.sin(9 * t), 0 * t), run_to(0 * t, 0.01 * np.sin(9 * t))
    yaw = [np.abs(trajectory(pack(machine(), "stepper", more), run)[0][:, 16]).max()
           for run in (along_x, along_y)]  # fmt: skip
    assert yaw[0] > 1e-5
    assert yaw[1] < 1e-6 * yaw[0]


def test_a_frame_takes_the_momentum_of_the_stage():
    mode = {"mass": 2.0, "frequency": 12.0, "damping_ratio": 0.05}
    more, values = slots("frame_mode", "frame", mode), machine(carriage_mass=0.3)
    t = np.arange(0.0, 1.0, STEP)
    q, v, _, _ = trajectory(pack(values, "stepper", more), run_to(0.02 * np.sin(30 * t), 0 * t))
    rate = 2 * np.pi * 12.0
    momentum = 2.0 * v[:, 14] + 0.3 * (v[:, 0] + v[:, 14])
    held = 2.0 * (rate**2 * q[:, 14] + 2 * 0.05 * rate * v[:, 14])
    lost = momentum + np.concatenate([[0.0], np.cumsum(0.5 * (held[1:] + held[:-1])) * STEP])
    assert np.abs(momentum).max() > 1e-2
    assert np.abs(lost).max() < 1e-3 * np.abs(momentum).max()


def test_creep_and_a_frame_go_on_while_friction_holds_the_stage():
    held = machine(carriage_coulomb_friction=2.0, bridge_coulomb_friction=2.0,
                   pulley_coulomb_friction=2e-3)  # fmt: skip
    t = np.arange(0.0, 1.0, STEP)
    run = run_to(np.minimum(0.1 * t, 0.005), 0 * t)
    mode = {"mass": 0.5, "frequency": 8.0, "damping_ratio": 0.01}
    u = trajectory(pack(held, "stepper", slots("frame_mode", "frame", mode)), run)[0][:, 14]
    assert np.ptp(u[-125:]) > 0.5 * np.ptp(u[200:325]) > 1e-8
    creep = slots("belt_relaxation", "belts", {"ratio": 0.5, "time_constant": 0.5})
    there, back = np.linspace(0.0, 0.005, 50), np.linspace(0.005, 0.0, 50)
    for more, least, most in ((creep, 1e-6, 1e-3), ({}, 0.0, 1e-7)):
        ends = []
        for rest in (500, 1000):
            x = np.concatenate([there, np.full(rest, 0.005), back])
            ends.append(shown(held, run_to(x, 0 * x), more)["x"][-50:])
        assert least <= np.abs(ends[0] - ends[1]).max() < most


@pytest.mark.parametrize(
    ("changed", "more"),
    [
        ({"carriage_mass": 0.0045}, {}),
        ({"pulley_inertia": 1.15e-7, "pulley_viscous_friction": 8.4e-4}, {"damping_time": 1.27e-3}),
    ],
)
def test_a_retuned_machine_stays_within_the_solvers_reach(changed, more):
    """A light carriage, or belts that damp beside viscous pulleys, are fast poles."""
    shows = shown(machine("yin2018", **changed), ramp(0.05, 0.4), more)
    assert all(np.abs(values).max() < 1.0 for name, values in shows.items() if name in "xy")
