"""Where fits begin: starts read off the recordings, waves and single recordings scored at once."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import (
    DELAY,
    STRIBECK,
    fitted,
    machine,
    other_motion,
    problem,
    record,
    rich_motion,
    short_motion,
    with_effects,
)

from corexy_fmi.effects import api, catalogue
from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.data.samples import even
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.starts import LOST, STIFFER, astray, central, starts, stiffer
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.local import last_parts, shows
from corexy_fmi.engine.judging.model import effect_table, tuned_machine
from corexy_fmi.engine.judging.prove import follow_up
from corexy_fmi.engine.naming.name import compete
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.spread import Spread, combinations, groups, spread
from corexy_fmi.engine.naming.tones import tones
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

JUMPS = ((2.0, 0.7), None, (-3.0, 1.4))  # steps and time of each recording
PHASES, SEEDS = (0.4, -1.5, 2.6), (0, 12, 2)
ALL = frozenset(catalogue())
SLOW = {"noise": 1e-5, "channels": ("x", "y")}


def fan(phase):
    """A force that shakes y."""
    use = {"amplitude": 0.3, "frequency": 17.3, "phase": phase}
    return EffectUse("periodic_disturbance", "y", use)


def slip(jump):
    """Missed steps, or none."""
    numbers = dict(zip(("steps", "time"), jump or (0.0, 0.0), strict=True))
    return EffectUse("missed_steps", "motor1", numbers)


@cache
def retuned(kind):
    """The retuned machine on three recordings of one kind of truth."""
    truths = [fan(p) for p in PHASES] if kind == "fan" else [slip(j) for j in JUMPS]
    recordings = [
        record(with_effects(machine(), truth), other_motion(), f"{n}.csv", seed=SEEDS[n], **SLOW)
        for n, truth in enumerate(truths)
    ]
    runs, _ = make_runs(recordings, recordings[:1], machine())
    return retune(bundled_layout(), machine(), tuple(runs))


@cache
def lead(kind):
    """The screen's answer to the truth."""
    name, place = ("periodic_disturbance", "y") if kind == "fan" else ("missed_steps", "motor1")
    return screen(retuned(kind), [Hypothesis((bundled_layout().find(name, place),))])[0]


@cache
def found(kind):
    """The fit that a competition of one ends with."""
    return (
        compete(retuned(kind), map, without=ALL - {lead(kind).hypothesis.key[0][0]}).entries[0].fit
    )


def began(kind, key):
    """Physical value of an unknown at the first start."""
    keys = [x.key for x in lead(kind).problem.unknowns]
    k = keys.index(key)
    return float(lead(kind).problem.unknowns[k].value(lead(kind).starts[0][k]))


def test_tones_of_the_residuals_are_starts():
    offered = spread(retuned("fan"))
    assert offered.frequency[0] == pytest.approx(17.3, abs=0.1)
    instance = bundled_layout().find("periodic_disturbance", "y")
    rows = combinations(instance, offered)
    assert {row["frequency"] for row in rows} == set(offered.frequency)
    assert sorted(map(len, groups(instance, rows))) == [len(api.PHASES)] * len(offered.frequency)


def test_samples_that_were_not_taken_shift_no_tone():
    """One in ten is blank, in bursts and alone: put together, tones would be a tenth higher."""
    whole = record(with_effects(machine(), fan(0.4)), other_motion(), **SLOW)
    random = np.random.default_rng(3)
    blank = random.random(len(whole)) < 0.05
    for burst in random.integers(0, len(whole) - 40, len(whole) // 800):
        blank[burst : burst + 40] = True
    kept = {n: np.where(blank, np.nan, whole[n]) for n in ("x", "y")}
    recording = replace(whole, channels={**whole.channels, **kept})
    assert blank.mean() == pytest.approx(0.1, abs=0.02)
    assert tones(fitted(problem(recording, machine(), std=1e-5), 2))[0] == pytest.approx(
        17.3, abs=0.15
    )


def test_an_even_clock_holds_every_sample_where_it_was_taken():
    time = 0.5 + 0.01 * np.array([0, 1, 2, 5, 6]) + 1e-4 * np.array([0, 1, -1, 1, 0])
    errors, spacing = even(np.array([1.0, 2.0, 3.0, 4.0, 5.0]), time)
    assert spacing == pytest.approx(0.01, rel=0.03)
    assert errors.tolist() == [-2, -1, 0, 0, 0, 1, 2]


def test_places_and_times_are_those_of_the_recordings():
    offered = spread(fitted(problem(record(machine(), short_motion()), machine()), 2))
    assert min(offered.x) == pytest.approx(0.0, abs=5e-4)
    assert max(offered.x) == pytest.approx(0.02, abs=1e-3)
    assert max(offered.y) == pytest.approx(0.015, abs=1e-3)
    assert 0 < offered.time[0] < offered.time[-1] < 1.5
    instance = bundled_layout().find("friction_vs_position", "y")
    assert {row["center"] for row in combinations(instance, offered)} == set(offered.y)


def test_what_a_drive_does_not_fit_begins_at_its_default():
    """A stepper's detents are 200 a turn, wherever a dc motor's begin."""
    detent = bundled_layout().find("detent_torque", "motors")
    order = next(p for p in detent.effect.parameters if p.name == "order")
    for drive, orders in (("stepper", {200.0}), ("dc", set(order.starts))):
        rows = combinations(detent, Spread((), (), (), (), drive))
        assert {row["order"] for row in rows} == orders


RINGING = [(e.name, p) for e in catalogue().values() for p in e.parameters if p.heard]


@pytest.mark.parametrize(("name", "parameter"), RINGING, ids=[name for name, _ in RINGING])
def test_what_rings_begins_at_the_tones_of_the_mismatch_too(name, parameter):
    (instance,) = (i for i in bundled_layout().instances if i.effect.name == name)
    heard = (0.5 * (parameter.lower + parameter.starts[0]), 2 * parameter.upper)
    offered = Spread((), (), (), heard, "stepper").starts(instance, parameter)
    assert offered == (*parameter.starts, heard[0], parameter.upper)


def test_a_frame_that_is_hardly_damped_is_found_by_its_tone():
    """Between the declared frequencies, 7 and 10 Hz, its cost is flat."""
    frame = EffectUse("frame_mode", "frame", {"mass": 6.0, "frequency": 8.4, "damping_ratio": 5e-3})
    shown = record(with_effects(machine(), frame), rich_motion(), noise=1e-5)
    base = retune(bundled_layout(), machine(), make_runs([shown], [], machine())[0])
    hypothesis = Hypothesis((bundled_layout().find("frame_mode", "frame"),))
    lead = screen(base, [hypothesis])[0]
    best = min((minimise(lead.problem, u, 10) for u in lead.starts), key=lambda fit: fit.cost)
    assert base.cost - best.cost > 60
    assert best.value("frame_mode.frame.frequency") == pytest.approx(8.4, abs=0.1)
    assert best.value("frame_mode.frame.mass") == pytest.approx(6.0, rel=0.3)


def test_a_wave_begins_near_the_phase_of_each_recording():
    """And ends at it."""
    for n, phase in enumerate(PHASES):
        key = f"periodic_disturbance.y.phase@{n}.csv"
        for value, near in ((began("fan", key), 1.0), (found("fan").value(key), 0.2)):
            assert np.angle(np.exp(1j * (value - phase))) == pytest.approx(0, abs=near)
    assert began("fan", "periodic_disturbance.y.amplitude") == pytest.approx(0.3, rel=0.4)
    assert found("fan").value("periodic_disturbance.y.amplitude") == pytest.approx(0.3, rel=0.05)


def test_a_jump_begins_at_its_time_in_each_recording():
    for n, jump in enumerate(JUMPS):
        steps = began("jump", f"missed_steps.motor1.steps@{n}.csv")
        if jump is None:
            assert abs(steps) < 0.6
        else:
            assert steps == pytest.approx(jump[0], rel=0.3)
            time = began("jump", f"missed_steps.motor1.time@{n}.csv")
            assert time == pytest.approx(jump[1], abs=0.03)


def test_parameters_of_one_recording_move_that_one_only():
    fit = found("jump")
    keys = [x.key for x in fit.problem.unknowns]
    first = fit.problem.runs[0].count
    column = fit.jacobian[:, keys.index("missed_steps.motor1.steps@0.csv")]
    assert np.abs(column[:first]).max() > 1.0
    assert np.abs(column[first : sum(r.count for r in fit.problem.runs)]).max() == 0.0


def test_they_are_found_and_reported_by_file():
    fit = found("jump")
    table = effect_table(fit, "missed_steps", "motor1", np.eye(fit.problem.size) * 1e-8)
    own = {f"{p}@{n}.csv" for p in ("steps", "time") for n in range(3)}
    assert set(table) == own | {"duration"}
    assert table["steps@2.csv"]["value"] == pytest.approx(-3.0, abs=0.05)
    assert table["time@2.csv"]["value"] == pytest.approx(1.4, abs=5e-3)
    assert table["time@2.csv"]["unit"] == "s"
    assert all(entry["determined"] for entry in table.values())
    blind = effect_table(fit, "missed_steps", "motor1", np.eye(fit.problem.size) * 1e12)
    assert not any(blind[f"{p}@{n}.csv"]["determined"] for p in ("steps", "time") for n in range(3))
    for n, steps, near in ((0, 2.0, 0.05), (1, 0.0, 0.3), (2, -3.0, 0.05)):
        (use,) = tuned_machine(fit, "found", n).effects
        assert use.parameters["steps"] == pytest.approx(steps, abs=near)


def test_they_are_judged_on_the_last_part_of_the_recordings_that_show_them():
    fit, base = found("jump"), retuned("jump")
    assert shows(fit) == [True, False, True]
    late = last_parts(base, fit, [], machine())
    assert [r.name for r in late.kept] == ["0.csv", "2.csv"]
    assert [r.role for r in late.kept] == ["holdout"] * 2
    for state, good in ((late.retuned, False), (late.fit, True)):
        chosen = tuned_machine(state, "judged", 2)
        noise = fit.problem.noise[2]
        told = follow_up(bundled_layout(), chosen, late.kept[1], noise, late.before["2.csv"])
        assert (told.rms(0) < 1.5e-5) == good


def test_the_parts_lack_the_spikes_that_the_whole_lacks():
    fit, base = found("jump"), retuned("jump")
    cut = []
    for run in fit.problem.runs:
        samples = [s.without(np.arange(len(s.index)) % 50 == 7) for s in run.samples]
        cut.append(run.with_samples(tuple(samples)))
    clean = replace(fit, problem=replace(fit.problem, runs=tuple(cut)))
    late = last_parts(base, clean, [], machine())
    whole = {run.name: run for run in cut}
    for part in (*late.kept, *late.before.values()):
        for samples, known in zip(part.samples, whole[part.name].samples, strict=True):
            assert len(samples.index) > 100
            assert set(samples.index) <= set(known.index)


def test_without_such_parameters_nothing_changes():
    fit = fitted(problem(record(machine(), short_motion()), machine()), 2)
    late = last_parts(fit, fit, ["kept"], machine())
    assert (late.fit, list(late.kept), dict(late.before)) == (fit, ["kept"], {})


def test_a_drive_fits_only_what_it_knows():
    instance = bundled_layout().find("detent_torque", "motors")
    recording = record(machine(), short_motion())
    keys = {x.key for x in problem(recording, machine(), [("detent_torque", "motors")]).unknowns}
    assert f"{instance.effect.name}.motors.holding_torque" in keys
    assert f"{instance.effect.name}.motors.order" not in keys
    chosen = problem(recording, machine(), [("detent_torque", "motors")])
    assert chosen.base[instance.parameter + 2] == 200.0  # its order stands at the default


def test_the_step_is_one_that_the_effects_starts_need():
    recording = record(with_effects(machine(), STRIBECK), short_motion())
    bare = problem(recording, machine()).limit
    assert problem(recording, machine(), [("sensor_lag", "sensor")]).limit == bare
    assert (
        problem(recording, machine(), [("belt_stiffness_vs_position", "belts")]).limit < bare / 1.5
    )


def test_a_search_from_stiffer_belts_holds_them():
    """What lags is sought where the belts give less, and short fits from there leave them so."""
    recording = record(with_effects(machine(), DELAY), short_motion())
    base = fitted(problem(recording, machine()))
    (stiff,) = stiffer(base)
    k = base.problem.keys.index("belt_axial_stiffness")
    assert stiff.u[k] == pytest.approx(base.u[k] + STIFFER)
    assert stiff.cost > base.cost
    find = bundled_layout().find
    delay, force = (
        Hypothesis((find(*u),)) for u in (("sensor_delay", "sensor"), ("constant_force", "x"))
    )
    assert [tried for _, tried, _ in starts(base, [delay, force], True)][-1] == [delay]
    (found,) = screen(stiff, [delay])
    assert not found.borrowed()[: -found.problem.size, k].any()


def test_a_search_from_the_machine_file_where_retuning_went_astray():
    """Every candidate is tried there, under white noise; a base that stayed near is not left."""
    base = fitted(problem(record(machine(), short_motion()), machine()), 0)
    k = base.problem.keys.index("carriage_mass")
    u = base.u.copy()
    u[k] = LOST * 1.01 * base.problem.unknowns[k].prior_std
    lost = replace(base, u=u)
    assert astray(lost) == pytest.approx(LOST * 1.01)
    (given,) = central(lost)
    assert not given.u[: base.problem.nominal_count].any()
    assert (given.u[base.problem.nominal_count :] == base.u[base.problem.nominal_count :]).all()
    assert all(not len(n.coefficients) for models in given.problem.noise for n in models)
    force = [Hypothesis((bundled_layout().find("constant_force", "x"),))]
    first, later = (list(starts(lost, force, whole)) for whole in (True, False))
    assert first[1][1] == force
    assert len(first) == len(later) + 2
    u[k] = LOST * 0.9 * base.problem.unknowns[k].prior_std
    assert central(replace(base, u=u)) == []
