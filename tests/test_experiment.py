"""Programs keep their limits; an ambiguous verdict names the one that settles it."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import (
    CASES,
    NOISE,
    fitted,
    machine,
    named,
    other_motion,
    problem,
    record,
    rich_motion,
    short_motion,
    with_effects,
)  # fmt: skip

from corexy_fmi.effects import catalogue
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.experiment import falls_out, rivals
from corexy_fmi.engine.foresee import Sensing, imagined
from corexy_fmi.engine.noise import Noise
from corexy_fmi.errors import InputError
from corexy_fmi.machine import EffectUse
from corexy_fmi.motion import check_stage, command
from corexy_fmi.programs import LONGEST, Limits, named_command, programs, recorded_limits
from corexy_fmi.simulate import simulate

LIMITS = Limits(0.04, 0.03, 0.08, 1.5)
WEAK = "run-out, weak"
FEW = frozenset(catalogue()) - {"pulley_eccentricity", "backlash"}  # to save time


@pytest.mark.parametrize("name", programs(LIMITS))
def test_a_program_keeps_its_limits(name):
    motion = programs(LIMITS)[name]
    time = np.arange(0, motion.duration, 1e-3)
    path = motion.position(time)
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / 1e-3
    assert motion.duration <= LONGEST
    assert (np.abs(path) <= [LIMITS.x + 1e-12, LIMITS.y + 1e-12]).all()
    assert speed.max() <= LIMITS.speed * 1.001
    assert np.abs(motion.end).max() < 1e-9
    assert np.abs(path[0]).max() < 1e-9
    check_stage(command(motion, 0.005), machine())


def test_recorded_limits_are_those_of_the_motion():
    order = command(programs(LIMITS)["strokes"], machine().parameters["pulley_radius"])
    seen = recorded_limits([order], machine())
    assert seen.x == pytest.approx(LIMITS.x, rel=0.3)
    assert seen.speed == pytest.approx(LIMITS.speed, rel=0.01)
    assert seen.acceleration <= 1.05 * LIMITS.acceleration


def test_limits_are_positive():
    with pytest.raises(InputError, match="speed: found 0"):
        Limits(0.1, 0.1, 0.0, 1.0)


@cache
def ambiguous():
    uses, name, options = CASES[WEAK]
    truth = with_effects(machine(name), *uses)
    train = [record(truth, rich_motion(), seed=1, **options)]
    judge = [record(truth, other_motion(), "judge.csv", seed=2, **options)]
    return truth, train, judge, diagnose(train, judge, machine(name), without=FEW)


def repeated(truth, order, n):
    """What the truth shows on an order, under fresh noise."""
    noise, random = CASES[WEAK][2].get("noise", NOISE), np.random.default_rng(90 + n)
    shown = simulate(truth, order)
    measured = {c: shown[c] + noise * random.normal(size=len(shown)) for c in ("x", "y")}
    return replace(order, name=f"{n}.csv", channels={**order.channels, **measured})


@pytest.mark.long
def test_the_next_experiment_settles_an_ambiguous_verdict():
    truth, train, judge, found = ambiguous()
    assert found.document["verdict"] == "ambiguous"
    assert found.document["next_experiment"]["program"] == found.experiment.order.name
    assert "pulley_eccentricity at pulley3" in found.experiment.why
    times = found.experiment.times
    assert f"run it {times} times" in found.experiment.why
    again = [repeated(truth, found.experiment.order, n) for n in range(times)]
    settled = diagnose([*train, *again], judge, machine(), without=FEW)
    assert settled.document["verdict"] == "explained"
    assert named(settled.document) == {("pulley_eccentricity", "pulley3")}
    assert settled.experiment is None


def test_it_stays_within_what_was_recorded():
    _, train, _, found = ambiguous()
    seen, asked = (recorded_limits(r, machine()) for r in (train, [found.experiment.order]))
    assert asked.x <= seen.x * 1.001
    assert asked.y <= seen.y * 1.001
    assert asked.speed <= seen.speed * 1.01
    assert named_command("a", programs(seen)["star"], machine()).name == "a"


def test_what_belongs_to_one_recording_is_no_rival():
    chosen = problem(record(machine(), short_motion()), machine(), [("missed_steps", "motor1")])
    other = problem(record(machine(), short_motion()), machine(), [("backlash", "motor1")])
    entries = [
        SimpleNamespace(hypothesis=p.hypothesis, fit=SimpleNamespace(problem=p), gain=99.0)
        for p in (chosen, other)
    ]
    keys = tuple(e.hypothesis.key for e in entries)
    verdict = SimpleNamespace(classes=(keys,), entry=entries[0])
    found = rivals(verdict, SimpleNamespace(entries=entries))
    assert [f.problem for f in found] == [other]


@pytest.mark.parametrize("torque", [2.0, 2e-3])
def test_a_program_that_a_weak_motor_cannot_follow_is_told(torque):
    """The belts ask more than 2 mN m of a rotor on the strokes: such a field lets it go."""
    weak = EffectUse("stepper_compliance", "motors", {"holding_torque": torque, "damping": 1e-3})
    given = with_effects(machine(), weak)
    fit = fitted(problem(record(machine(), short_motion()), given), 0)
    sensing = Sensing({c: Noise(np.zeros(0), NOISE, NOISE) for c in ("x", "y")})
    order = named_command("a", programs(LIMITS)["strokes"], given)
    assert falls_out(fit, imagined(order, given, sensing), sensing) == (torque < 1)
