"""The output-error problem, its fits and the score test."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import (
    ASIDE,
    BACKLASH,
    DELAY,
    MISMATCH,
    NOISE,
    STRIBECK,
    fitted,
    machine,
    problem,
    record,
    rich_motion,
    short_motion,
    with_effects,
)

from corexy_fmi.engine.fitting.fit import minimise, own_noise, settle
from corexy_fmi.engine.fitting.holding import deflection_scale, holding_stiffness
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.slopes import step_lengths
from corexy_fmi.engine.judging.model import covariance, retuned_table, tuned_machine
from corexy_fmi.engine.judging.prove import replay
from corexy_fmi.engine.naming.again import begun_in_balance
from corexy_fmi.engine.naming.candidates import hypotheses, instances
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse
from corexy_fmi.simulate import excitation, machine_vector

KINK = 0.5  # whitened; of friction whose bound is near


def differences(chosen, u, column, step):
    """One column of the Jacobian by central differences, by halved forward ones at a bound."""
    sets = np.repeat(u[None], 2, axis=0)
    sets[:, column] += [step, -step]
    if sets[1, column] < chosen.limits()[0][column]:
        sets[:, column] = u[column] + np.array([step / 2, 0.0])
    high, low = chosen.residual(sets)
    return (high - low) / (sets[0, column] - sets[1, column])


@pytest.mark.parametrize("name", ["yin2018", "yin2018_dc"])
@pytest.mark.parametrize("uses", [(), (("belt_mismatch", "belts"),), (("sensor_delay", "sensor"),)])
def test_the_jacobian_is_that_of_central_differences(name, uses):
    recording = record(with_effects(machine(name), **ASIDE), short_motion())
    chosen = problem(recording, machine(name), uses)
    u = np.zeros(chosen.size)
    if uses:
        u[len(chosen.unknowns) - 1] = 0.5
    _, jacobian = chosen.linearised(u)
    steps = step_lengths(chosen, u)
    keys = [x.key for x in chosen.unknowns]
    for column in set(range(chosen.size)) - {keys.index("friction_smoothing")}:  # begins at a kink
        exact = differences(chosen, u, column, abs(steps[column]))
        size = np.linalg.norm(exact)
        assert size > 0
        off = np.linalg.norm(jacobian[:, column] - exact)
        assert off < 0.05 * size + KINK, column


def test_an_offset_costs_nothing():
    """Offsets of the channels are projected out: adding one changes no residual."""
    recording = record(machine(), short_motion())
    moved = {n: recording[n] + d for n, d in (("x", 3e-4), ("y", -2e-4))}
    shifted = replace(recording, channels={**recording.channels, **moved})
    one, other = (problem(r, machine()) for r in (recording, shifted))
    u = np.zeros((1, one.size))
    assert other.residual(u) == pytest.approx(one.residual(u), abs=1e-6)


@pytest.mark.parametrize(
    ("use", "key"),
    [(("torque_ripple", "motors"), "order"), (("periodic_disturbance", "x"), "frequency")],
)
def test_less_than_two_waves_are_no_wave(use, key):
    """A ripple hardly shorter than the travel, or a beat than the recording, is a slope."""
    order = record(machine("yin2018_dc"), short_motion())
    chosen = problem(order, machine("yin2018_dc"), (use,))
    found = next(x for x in chosen.unknowns if x.key.endswith(key))
    run = chosen.runs[0].excitation
    turns = max(np.ptp(run.input1), np.ptp(run.input2)) / (2 * np.pi)
    covered = {"order": turns, "frequency": np.ptp(run.time)}[key]
    assert found.bounds[0] == pytest.approx(
        max(2 / covered, {"order": 1.0, "frequency": 0.05}[key])
    )
    assert found.value(found.limits()[0]) == pytest.approx(found.bounds[0])


def test_idlers_held_by_their_friction_are_fitted():
    """A move along x before left the idlers nine tenths of what they can hold."""
    chosen, layout = machine(), bundled_layout()
    order = record(chosen, short_motion())
    rest = np.array([[0.0, 0.0, 0.9, 0.9, 0.0, 0.0]])
    x, y = run_lanes(layout, excitation(chosen, order), machine_vector(chosen, layout)[None],
                     rest=rest)[0]  # fmt: skip
    noise = 2e-7 * np.random.default_rng(4).normal(size=(2, len(x)))
    recording = replace(order, channels={**order.channels, "x": x + noise[0], "y": y + noise[1]})
    fit = fitted(problem(recording, chosen, std=2e-7))
    assert fit.problem.rest(fit.u[None], 0)[0, 2:4] == pytest.approx(rest[0, 2:4], abs=0.03)
    assert 0.5 * fit.residual @ fit.residual < 0.6 * fit.problem.runs[0].count


def test_rotors_that_stiction_holds_off_their_command_are_fitted():
    """A loop at rest leaves them anywhere within their friction; here 150 and -80 urad off."""
    chosen, layout = machine("yin2018_dc"), bundled_layout()
    shown = ("x", "y", "phi1_meas", "phi2_meas")
    order = record(chosen, short_motion(), noise=0.0, channels=shown)
    rest = np.array([[0.0, 0.0, 0.0, 0.0, 1.5e-4, -8e-5]])
    out = run_lanes(layout, excitation(chosen, order), machine_vector(chosen, layout)[None],
                    dc=True, rest=rest, channels=("x", "y", "phi1", "phi2"))[0]  # fmt: skip
    noise = np.random.default_rng(5).normal(size=out.shape) * [[1e-6], [1e-6], [2e-5], [2e-5]]
    measured = dict(zip(shown, out + noise, strict=True))
    recording = replace(order, channels={**order.channels, **measured})
    white = tuple(Noise(np.zeros(0), s, s) for s in (1e-6, 1e-6, 2e-5, 2e-5))
    fit = fitted(replace(problem(recording, chosen), noise=(white,)))
    found = fit.problem.rest(fit.u[None], 0)[0, 4:]
    assert found == pytest.approx(rest[0, 4:], abs=2e-5)
    assert 0.5 * fit.residual @ fit.residual < 0.52 * fit.problem.runs[0].count


def test_a_pull_that_was_there_before_leaves_rotors_off_their_command(monkeypatch):
    """A loop gives way to a steady pull; rotors held at their command would leave many nats."""
    chosen, layout, force = machine("yin2018_dc"), bundled_layout(), -0.3
    shown, std = ("x", "y", "phi1_meas", "phi2_meas"), (2e-5, 2e-5, 1e-4, 1e-4)
    order = record(chosen, short_motion(), noise=0.0, channels=shown)
    order = replace(order, metadata=order.metadata | {"zero": "x, y"})
    e, radius = excitation(chosen, order), chosen.parameters["pulley_radius"]
    lean = radius / 2 * force / (chosen.at("motor_torque_gain") * e.kp)
    rest = np.array([[0.0, force / holding_stiffness(chosen), 0.0, 0.0, lean, -lean]])
    pulled = with_effects(chosen, EffectUse("constant_force", "y", {"force": force}))
    out = run_lanes(layout, e, machine_vector(pulled, layout)[None], dc=True, rest=rest,
                    channels=("x", "y", "phi1", "phi2"))[0]  # fmt: skip
    noise = np.random.default_rng(5).normal(size=out.shape) * np.array(std)[:, None]
    measured = dict(zip(shown, out + noise, strict=True))
    recording = replace(order, channels={**order.channels, **measured})
    white = tuple(Noise(np.zeros(0), s, s) for s in std)
    asked = replace(problem(recording, chosen, (("constant_force", "y"),)), noise=(white,))
    fit = fitted(asked)
    assert fit.value("constant_force.y.force") == pytest.approx(force, abs=0.04)  # two deviations
    assert 0.5 * fit.residual @ fit.residual < 0.52 * fit.problem.runs[0].count
    monkeypatch.setattr("corexy_fmi.engine.fitting.holding.rotor_scale", lambda *_: 0.0)
    monkeypatch.setattr("corexy_fmi.engine.fitting.parametrisation.pulls", lambda _: ())
    assert fitted(replace(asked)).cost > fit.cost + 40.0


def test_the_initial_deflection_is_fitted():
    """Nobody knows where stiction left the belts; here it left them 20 and -10 um aside."""
    order, layout = record(machine(), short_motion()), bundled_layout()
    rest = np.array([[2e-5, -1e-5, 0.0, 0.0, 0.0, 0.0]])
    out = run_lanes(layout, excitation(machine(), order), machine_vector(machine(), layout)[None],
                    rest=rest)[0]  # fmt: skip
    noise = 1e-6 * np.random.default_rng(3).normal(size=out.shape)
    x, y = out + noise
    recording = replace(order, channels={**order.channels, "x": x, "y": y})
    fit = fitted(problem(recording, machine(), std=1e-6))
    found = fit.problem.rest(fit.u[None], 0)[0, :2]
    assert found == pytest.approx(rest[0, :2], abs=3e-6)
    assert 0.5 * fit.residual @ fit.residual < 0.6 * fit.problem.runs[0].count
    assert deflection_scale(machine()) > 1e-6


@pytest.mark.parametrize("name", ["yin2018", "yin2018_dc", "gt2_printer"])
def test_the_optimum_is_found(name):
    """The fit costs no more than the truth, and what the data can tell lies in its intervals."""
    truth = with_effects(machine(name), **ASIDE)
    chosen = problem(record(truth, rich_motion()), machine(name))
    fit = fitted(chosen)
    u = np.zeros(chosen.size)
    for k, unknown in enumerate(chosen.unknowns):
        u[k] = unknown.internal(truth.parameters[unknown.key])
    true_residual = chosen.residual(u[None])[0]
    assert fit.cost - chosen.log_scale() <= 0.5 * true_residual @ true_residual
    table = retuned_table(fit, covariance(fit))
    low, high = table["carriage_viscous_friction"]["ci95"]
    assert low < truth.parameters["carriage_viscous_friction"] < high
    assert fit.cost < fitted(chosen, 0).cost - 50


def test_every_start_ends_at_the_same_cost():
    chosen = problem(record(with_effects(machine(), **ASIDE), short_motion()), machine())
    random = np.random.default_rng(7)
    starts = 0.1 * random.normal(size=(3, chosen.size))
    costs = [minimise(chosen, start, 30, 0.0).cost for start in starts]
    assert np.ptp(costs) < 0.5


def test_a_fit_never_gets_worse_and_repeats_itself():
    chosen = problem(record(with_effects(machine(), **ASIDE), short_motion()), machine())
    costs = [fitted(chosen, n).cost for n in (0, 1, 2, 6)]
    assert costs == sorted(costs, reverse=True)
    one, other = fitted(chosen), fitted(chosen)
    assert np.array_equal(one.u, other.u)


def test_priors_hold_what_the_data_cannot_tell():
    chosen = problem(record(machine(), short_motion()), machine())
    fit = fitted(chosen)
    table = retuned_table(fit, covariance(fit))
    assert any(entry["prior_driven"] for entry in table.values())
    assert not table["carriage_viscous_friction"]["prior_driven"]
    assert max(abs(entry["pull"]) for entry in table.values()) < 3


def test_the_noise_is_that_of_the_residuals():
    recording = record(machine(), rich_motion(), noise=3e-5)
    fit = settle(fitted(problem(recording, machine(), std=NOISE)))
    for noise in own_noise(fit).noise[0]:
        assert noise.marginal == pytest.approx(3e-5, rel=0.05)
        assert len(noise.coefficients) == 0


PLANTED = {
    "stribeck": (STRIBECK, "yin2018"),
    "backlash": (BACKLASH, "yin2018"),
    "mismatch": (MISMATCH, "yin2018"),
    "delay": (DELAY, "yin2018"),
    "backlash, dc": (BACKLASH, "yin2018_dc"),
}


@pytest.mark.parametrize(("use", "name"), PLANTED.values(), ids=PLANTED)
def test_the_score_test_orders_the_candidates(use, name):
    """The planted effect leads, or its near twin does."""
    recording = record(with_effects(machine(name), use, **ASIDE), rich_motion())
    base = settle(fitted(problem(recording, machine(name))))
    leads = screen(base, hypotheses(base.problem, base.u))
    named = [lead.hypothesis.key[0] for lead in leads if not lead.hypothesis.law]
    assert (use.name, use.location) in named[:2]
    gains = [lead.gain for lead in leads]
    assert gains == sorted(gains, reverse=True)
    assert gains[0] > 10


def test_every_place_of_every_effect_is_a_candidate_once():
    chosen = problem(record(machine(), short_motion()), machine())
    keys = [h.key for h in hypotheses(chosen, np.zeros(chosen.size)) if h.uses]
    assert len(keys) == len(set(keys))
    assert (("backlash", "motor2"),) in keys
    struck = hypotheses(chosen, np.zeros(chosen.size), frozenset({"backlash"}))
    assert all(h.key[0][0] != "backlash" for h in struck)
    known = with_effects(machine(), BACKLASH)
    left = {(i.effect.name, i.location) for i in instances(bundled_layout(), known)}
    assert ("backlash", "motor1") not in left
    assert ("backlash", "motor2") in left


def test_a_fit_is_a_machine_that_replays_it():
    recording = record(with_effects(machine(), BACKLASH, **ASIDE), rich_motion())
    fit = fitted(problem(recording, machine(), [("backlash", "motor1")]))
    found = tuned_machine(fit, "found")
    again = problem(recording, found, pinned=True)
    u = np.concatenate([fit.u[len(fit.problem.unknowns) :]])[None]
    replayed = again.simulate(u, 0)[0]
    assert replayed == pytest.approx(fit.problem.simulate(fit.u[None], 0)[0], abs=1e-6)
    (use,) = found.effects
    assert use.parameters["gap"] == pytest.approx(0.02, rel=0.1)


def test_where_a_loose_pulley_begins_is_found_for_each_run():
    """Its seat at the start is no parameter of the effect: each replay finds it again."""
    planted = replace(BACKLASH, parameters={"gap": 0.2, "seat1": -0.8})
    recording = record(with_effects(machine("yin2018"), planted), short_motion())
    chosen = problem(recording, machine("yin2018"), (("backlash", "motor1"),))
    assert chosen.keys[-1] == "backlash.motor1.seat1 of run 0"
    start = np.zeros(chosen.size)
    start[chosen.keys.index("backlash.motor1.gap")] = 8.0
    fit = minimise(chosen, start, 15)
    assert fit.u[-1] == pytest.approx(-0.8, abs=0.2)
    again = tuned_machine(fit, "again")
    assert again.effects[0].parameters["seat1"] == 0.0
    replayed = replay(chosen.layout, again, chosen.runs[0], chosen.noise[0])
    assert replayed.fit.u[-1] == pytest.approx(fit.u[-1], abs=0.05)


def test_what_one_problem_found_is_carried_into_another_by_name():
    recording = record(machine("yin2018"), short_motion())
    small = problem(recording, machine("yin2018"))
    large = problem(recording, machine("yin2018"), (("backlash", "motor1"),))
    u = np.arange(1.0, 1.0 + large.size)
    assert large.keys.index("backlash.motor1.seat1 of run 0") == large.size - 1
    carried = small.carried(large, u)
    assert (
        dict(zip(small.keys, carried, strict=True)).items()
        <= dict(zip(large.keys, u, strict=True)).items()
    )
    assert large.carried(small, carried)[-1] == 0.0


def test_a_fit_keeps_its_residual_alone():
    """Neither a Jacobian nor the trials beside the best: of six minutes a fit would hold 100 MB."""
    fit = fitted(problem(record(machine(), short_motion()), machine()), 4)
    assert fit.slopes is None
    kept = fit.residual if fit.residual.base is None else fit.residual.base
    assert kept.size == fit.residual.size
    exact = fit.problem.linearised(fit.u)[1]
    assert (fit.jacobian == exact).all()


def test_a_fit_that_breaks_down_under_its_own_noise_stays(monkeypatch):
    fit = fitted(problem(record(machine(), short_motion()), machine()), 1)
    broken = replace(fit, cost=np.inf, residual=np.full_like(fit.residual, np.inf))
    calls = []
    monkeypatch.setattr(
        "corexy_fmi.engine.fitting.fit.minimise", lambda *given: calls.append(given) or broken
    )
    assert settle(fit) is fit
    assert len(calls) == 1
    assert settle(broken) is broken
    assert len(calls) == 1


@pytest.mark.parametrize("far", [np.nan, np.inf, 1e200])
def test_a_run_that_breaks_down_tells_no_noise(monkeypatch, far):
    fit = fitted(problem(record(machine(), short_motion()), machine()), 1)
    errors = fit.problem.errors(fit.u[None], 0)
    errors[0][0, -1] = far
    monkeypatch.setattr(type(fit.problem), "errors", lambda *given: errors)
    assert own_noise(fit) is fit.problem


def test_a_fit_that_begins_far_from_balance_is_begun_again_in_it():
    """Four times as far as stiction holds, another stop is near, and no slope leads back."""
    chosen = problem(record(machine(), short_motion()), machine())
    fit = fitted(chosen)
    assert begun_in_balance(fit) is fit
    far = fit.u.copy()
    at = chosen.keys.index("deflection along y of run 0")
    far[at] = -3.5
    stuck = minimise(chosen, far, 0)
    again = begun_in_balance(stuck)
    assert again.cost < stuck.cost - 10
    assert abs(again.u[at]) < 1
