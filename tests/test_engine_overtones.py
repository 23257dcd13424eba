"""A sine in time may be the overtone of pulses: their size and place, and a fit that finds them."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import (
    BACKLASH,
    machine,
    other_motion,
    problem,
    record,
    rich_motion,
    with_effects,
)

from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.naming.overtones import (
    DUTIES,
    OVERTONES,
    _phase,
    _share,
    alone,
    overtone_fits,
)
from corexy_fmi.engine.naming.pairs import _parts
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.engine.naming.worth import pays
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

FREQUENCY, DUTY, KTH = 9.7, 0.15, 3
TRAIN = {"amplitude": 0.3, "frequency": FREQUENCY, "duty": DUTY}


@pytest.mark.parametrize("duty", DUTIES)
@pytest.mark.parametrize("k", range(1, OVERTONES + 1))
def test_the_overtone_of_the_pulses_is_the_sine(k, duty):
    """Fourier's integral over a period, wherever of k places the pulses lie."""
    turns = (np.arange(100000) + 0.5) / 100000
    for sine in (-2.5, 0.3, 1.9):
        for place in range(k if _share(k, duty) else 0):
            phase = _phase(sine, k, duty, place)
            on = np.mod(turns + phase / (2 * np.pi), 1) < duty
            wave = 2 * np.mean(on * np.exp(-2j * np.pi * k * turns))  # of exp(j 2 pi k f t)
            assert abs(_share(k, duty)) * np.exp(1j * (sine - np.pi / 2)) == pytest.approx(
                wave, abs=1e-3
            )


def began(fit, key):
    """Value of an unknown of a fit."""
    unknown = next(x for x in fit.problem.unknowns if x.key.endswith(key))
    return float(unknown.value(fit.u[fit.problem.unknowns.index(unknown)]))


@pytest.mark.parametrize("others", [(), (BACKLASH,)], ids=["alone", "beside play"])
def test_pulses_are_found_from_a_sine_at_their_overtone(others):
    bare, runs = machine(), []
    for n, (motion, phase) in enumerate([(rich_motion(), 0.4), (other_motion(), -2.0)]):
        pulses = EffectUse("periodic_disturbance", "x", TRAIN | {"phase": phase})
        truth = with_effects(bare, *others, pulses)
        shown = record(truth, motion, f"{n}.csv", seed=n, noise=2e-6)
        runs += problem(shown, bare).runs
    base = retune(bundled_layout(), bare, tuple(runs))
    known = [(use.name, use.location) for use in others]
    chosen = problem(shown, bare, [*known, ("periodic_disturbance", "x")])
    chosen = replace(base.problem, hypothesis=chosen.hypothesis)
    start = chosen.carried(base.problem, base.u)
    for k, unknown in enumerate(chosen.unknowns):
        if unknown.key.endswith("frequency"):
            start[k] = unknown.internal(KTH * FREQUENCY)
        if unknown.key.endswith("amplitude"):
            start[k] = unknown.internal(0.05)
    found = overtone_fits(base, [minimise(chosen, start, 20)], map)[0]
    assert began(found, "frequency") == pytest.approx(FREQUENCY, rel=1e-3)
    assert began(found, "duty") == pytest.approx(DUTY, rel=0.1)
    assert began(found, "amplitude") == pytest.approx(0.3, rel=0.1)


def test_only_a_sine_in_time_is_taken_for_an_overtone():
    bare = machine()
    chosen = problem(record(bare, other_motion()), bare, [("backlash", "motor1")])
    fit = minimise(chosen, np.zeros(chosen.size), 1)
    assert overtone_fits(fit, [fit], map) == []
    assert overtone_fits(fit, [], map) == []


def test_pulses_beside_a_force_that_they_do_not_need_are_told_alone():
    """A sine leaves the mean of pulses to a constant force; the pulses themselves hold it."""
    bare = machine()
    pulses = EffectUse("periodic_disturbance", "x", TRAIN | {"phase": 0.4})
    shown = record(with_effects(bare, pulses), rich_motion(), noise=2e-6)
    both = problem(shown, bare, [("constant_force", "x"), ("periodic_disturbance", "x")], 2e-6)
    both = replace(both, hypothesis=replace(both.hypothesis, shaped=True))
    truth = TRAIN | {"phase": 0.4, "force": 0.0}
    start = np.zeros(both.size)
    for k, unknown in enumerate(both.unknowns):
        if "." in unknown.key:
            start[k] = unknown.internal(truth[unknown.key.split(".")[2].partition("@")[0]])
    pair = minimise(both, start, 10)
    single = alone(pair)
    assert [i.effect.name for i in single.problem.hypothesis.uses] == ["periodic_disturbance"]
    assert single.problem.hypothesis.shaped
    assert rank(single) < rank(pair)
    better, beside = single.cost - 100, replace(single.problem, hypothesis=both.hypothesis)
    other = replace(single, cost=better, problem=beside)
    assert _parts(pair, [other, single]) == [other, single]
    assert not pays(single, pair, single)


def test_a_sine_beside_another_cause_is_told_alone_as_a_sine():
    bare = machine()
    wave = EffectUse("periodic_disturbance", "x", {"amplitude": 0.3, "frequency": 9.7})
    shown = record(with_effects(bare, wave), other_motion(), noise=2e-6)
    both = problem(shown, bare, [("constant_force", "x"), ("periodic_disturbance", "x")], 2e-6)
    start = np.zeros(both.size)
    for k, unknown in enumerate(both.unknowns):
        if unknown.key.endswith("frequency"):
            start[k] = unknown.internal(9.7)
    single = alone(minimise(both, start, 10))
    assert [i.effect.name for i in single.problem.hypothesis.uses] == ["periodic_disturbance"]
    assert not single.problem.hypothesis.shaped
    assert began(single, "amplitude") == pytest.approx(0.3, rel=0.1)
