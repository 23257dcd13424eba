"""A stage that something pulls may rest where belts, and a loop, bear what stiction does not."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, problem, record, short_motion, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.balance import leaning, pulls
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.holding import holding_stiffness, rest_scale
from corexy_fmi.engine.fitting.parametrisation import Parametrisation
from corexy_fmi.kernel.call import REST, Excitation
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, load_machine
from corexy_fmi.motion import command, rest
from corexy_fmi.simulate import machine_vector, simulate

FORCE = 5.0  # [N], where stiction holds 0.2 N
CASES = {
    ("constant_force", "x"): {"force": FORCE},
    ("constant_force", "y"): {"force": -FORCE},
    ("cable_drag", "y"): {"stiffness": 50.0, "center": 0.1},
}


def standing(use, name="yin2018"):
    """A problem of a machine with this effect, that stands still for a second."""
    pulled = with_effects(machine(name), use)
    recording = record(pulled, rest((0.01, -0.02), 1.0), noise=0.0)
    return problem(recording, pulled), pulled


@pytest.mark.parametrize("key", CASES, ids="-".join)
@pytest.mark.parametrize("name", ["yin2018", "yin2018_dc", "light_bench", "gt2_printer"])
def test_a_pulled_stage_stands_still_where_it_is_in_balance(key, name):
    """Belts give by the force over their stiffness, and a loop by its torque over its own."""
    asked, pulled = standing(EffectUse(*key, CASES[key]), name)
    force = 6.0 if key[0] == "cable_drag" else CASES[key]["force"]
    loads = force * np.array([key[1] == "x", key[1] == "y"])
    off = np.r_[loads / holding_stiffness(pulled), np.zeros(4)]
    if pulled.drive == "dc":
        turning = (
            pulled.parameters["pulley_radius"] / 2 * np.array([sum(loads), -np.diff(loads)[0]])
        )
        off[4:] = turning / (pulled.at("motor_torque_gain") * pulled.controller.kp)
    u = np.zeros((1, asked.size))
    keys = [REST.index(key) for key in asked.own_keys]
    u[0, asked.first_own(0) :] = off[keys] / ones(asked)[keys]
    assert np.abs(u).max() < 1.0
    shown = asked.simulate(u, 0, ("x_true", "y_true"))[0]
    assert np.ptp(shown, axis=1) == pytest.approx([0.0, 0.0], abs=2e-8)


def ones(asked):
    """What a run begins with where all of its nuisances are one deviation off, (6,)."""
    return asked.rest(np.r_[np.zeros(len(asked.unknowns)), np.ones(asked.own)][None], 0)[0]


@pytest.mark.parametrize(("force", "borne"), [(0.15, 0.0), (0.3, 0.2), (-0.3, 0.2), (0.6, 0.6)])
def test_stiction_of_a_fifth_of_a_newton_bears_its_share(force, borne):
    asked, pulled = standing(EffectUse("constant_force", "x", {"force": force}))
    more = rest_scale(asked.machine, asked.runs[0].excitation)
    assert ones(asked)[0] - more[0] == pytest.approx(borne / holding_stiffness(pulled), rel=1e-9)
    assert ones(asked)[1:] == pytest.approx(more[1:])


@pytest.mark.parametrize("name", ["emps", "flexdrive"])
def test_where_motors_are_axes_nothing_is_moved(name):
    """A loop holds them, if anything does; their deflection is free around the command."""
    given = load_machine(name)
    pulled = with_effects(given, EffectUse("constant_force", "x", {"force": 3.0}))
    e = Excitation(np.arange(3) * 1e-3, np.zeros(3), np.zeros(3), mode="closed_loop", kp=100.0)
    vectors = machine_vector(pulled, bundled_layout())[None]
    found = pulls([bundled_layout().find("constant_force", "x")])
    assert not leaning(found, pulled, e, vectors, vectors[0]).any()


def test_forces_of_the_place_alone_pull_at_rest():
    """Of all effects: what depends on speed, time or friction does not."""
    found = {i.effect.name for i in bundled_layout().instances if pulls([i])}
    assert found == {"constant_force", "cable_drag"} <= set(catalogue())


def pulled_recording(before):
    """A stage that leaned for so many rows before its recording began, its zero known."""
    use, quiet = EffectUse("constant_force", "x", {"force": FORCE}), 1e-6
    truth = with_effects(machine(), use)
    order = command(short_motion(), truth.parameters["pulley_radius"], name="t.csv")
    held = {n: np.r_[np.full(before, v[0]), v] for n, v in order.channels.items()}
    time = np.r_[np.arange(before) * 1e-3, order.time + before * 1e-3]
    response = simulate(truth, replace(order, time=time, channels=held))
    random = np.random.default_rng(2)
    seen = {n: response[n][before:] + quiet * random.normal(size=len(order)) for n in "xy"}
    return replace(order, channels=order.channels | seen, metadata={"zero": "x, y"}), quiet


def begun(asked):
    """A fit from a declared start of 4 N."""
    u = np.zeros(asked.size)
    u[asked.keys.index("constant_force.x.force")] = 8.0  # half newtons
    return minimise(asked, u, 20)


@pytest.mark.parametrize("before", [0, 1000], ids=["is let go", "has leaned"])
def test_a_stage_that_leans_is_fitted(before, monkeypatch):
    """One that has leaned does not spring at its first row, one that is let go does."""
    recording, quiet = pulled_recording(before)
    asked = problem(recording, machine(), [("constant_force", "x")], std=quiet)
    fit = begun(asked)
    assert fit.value("constant_force.x.force") == pytest.approx(FORCE, rel=0.05)
    assert 0.5 * fit.residual @ fit.residual < 0.6 * fit.problem.runs[0].count
    monkeypatch.setattr(Parametrisation, "pulls", ())
    dearer = begun(replace(asked)).cost - fit.cost  # which looks for pulls anew
    assert dearer > 100.0 if before else dearer == pytest.approx(0.0, abs=1.0)


def test_a_run_that_begins_in_motion_is_not_moved():
    use = EffectUse("constant_force", "x", {"force": FORCE})
    asked = problem(record(machine(), short_motion()), with_effects(machine(), use))
    run = asked.runs[0]
    moving = replace(asked, runs=(replace(run, excitation=replace(run.excitation, lead=0.3)),))
    assert ones(asked)[0] > 10 * ones(moving)[0] > 0
