"""A stage that something pulls rests where belts, and a loop, bear what stiction does not."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, short_motion, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.balance import pulls
from corexy_fmi.engine.fitting.holding import holding_stiffness
from corexy_fmi.engine.fitting.parametrisation import Parametrisation
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse
from corexy_fmi.motion import command, rest
from corexy_fmi.simulate import excitation, simulate

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
def test_a_pulled_stage_rests_where_it_begins(key, name):
    asked, pulled = standing(EffectUse(*key, CASES[key]), name)
    shown = asked.simulate(np.zeros((1, asked.size)), 0, ("x_true", "y_true"))[0]
    assert np.ptp(shown, axis=1) == pytest.approx([0.0, 0.0], abs=2e-8)
    off = shown[:, 0] - (0.01, -0.02)
    axis = "xy".index(key[1])
    if pulled.drive == "stepper":
        dry = pulled.parameters[("carriage", "bridge")[axis] + "_coulomb_friction"]
        load = FORCE * 1.2 if key[0] == "cable_drag" else abs(asked_force(key))
        assert abs(off[axis]) == pytest.approx((load - dry) / holding_stiffness(pulled), rel=0.01)
        assert abs(off[1 - axis]) < 1e-9
    else:
        assert abs(off[axis]) > 1e-6


def asked_force(key):
    """Of the constant forces [N]."""
    return CASES[key]["force"]


def test_what_stiction_holds_moves_nothing():
    asked, _ = standing(EffectUse("constant_force", "x", {"force": 0.15}))
    assert not asked.rest(np.zeros((1, asked.size)), 0).any()


def test_forces_of_the_place_alone_pull_at_rest():
    """Of all effects: what depends on speed, time or friction does not."""
    found = {i.effect.name for i in bundled_layout().instances if pulls([i])}
    assert found == {"constant_force", "cable_drag"} <= set(catalogue())


def leaning_recording():
    """A stage that leaned for a second before its recording began, its zero known."""
    use = EffectUse("constant_force", "x", {"force": FORCE})
    truth, before, quiet = with_effects(machine(), use), 1.0, 1e-6
    order = command(replace(short_motion()), truth.parameters["pulley_radius"], name="t.csv")
    rows = int(before * 1000)
    held = {n: np.r_[np.full(rows, v[0]), v] for n, v in order.channels.items()}
    time = np.r_[np.arange(rows) * 1e-3, order.time + before]
    longer = replace(order, time=time, channels=held)
    response, random = simulate(truth, longer), np.random.default_rng(2)
    seen = {n: response[n][rows:] + quiet * random.normal(size=len(order)) for n in "xy"}
    return replace(order, channels=order.channels | seen, metadata={"zero": "x, y"}), quiet


def test_a_stage_that_leaned_before_is_fitted(monkeypatch):
    """From where nothing leans it would have to spring at its first row, which it did not."""
    recording, quiet = leaning_recording()
    asked = problem(recording, machine(), [("constant_force", "x")], std=quiet)
    fit = fitted(asked)
    assert fit.value("constant_force.x.force") == pytest.approx(FORCE, rel=0.05)
    assert 0.5 * fit.residual @ fit.residual < 0.6 * fit.problem.runs[0].count
    monkeypatch.setattr(Parametrisation, "pulls", ())
    assert fitted(replace(asked)).cost > fit.cost + 100.0  # which looks for pulls anew


def test_a_run_that_begins_in_motion_is_not_moved():
    use = EffectUse("constant_force", "x", {"force": FORCE})
    recording = record(with_effects(machine(), use), short_motion())
    asked = problem(recording, with_effects(machine(), use))
    run = asked.runs[0]
    led = replace(run.excitation, lead=0.3)
    moving = replace(asked, runs=(replace(run, excitation=led),))
    assert asked.rest(np.zeros((1, asked.size)), 0).any()
    assert not moving.rest(np.zeros((1, moving.size)), 0).any()
    assert excitation(machine(), recording).lead == 0.0
