"""What a fit leaves to simple functions of the motion, and what noise does at rest."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.clean import without_spikes
from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.quiet import at_rest, independent
from corexy_fmi.engine.naming.specification import TRACE, Leftover, functions, leftover, removed
from corexy_fmi.machine import EffectUse
from corexy_fmi.motion import chain, rest
from tests.engine_kit import (
    NOISE,
    fitted,
    machine,
    pair,
    problem,
    record,
    rich_motion,
    with_effects,
)

BENCH = "light_bench"
CAUSES = {
    ("backlash", "motor1"): ({"gap": 0.012}, ("motor1", "velocity_reversal")),
    ("pulley_eccentricity", "motor2"): (
        {"amplitude": 2e-5, "phase": 0.5},
        ("motor2", "motor_angle"),
    ),
}


def truth(use):
    return replace(machine(BENCH), effects=(EffectUse(*use, CAUSES[use][0]),))


def left(uses, planted):
    """The leftover of a fit of some effects to a recording of planted ones."""
    recording = record(truth(planted) if planted else machine(BENCH), rich_motion())
    return leftover(settle(fitted(problem(recording, machine(BENCH), uses))))


@pytest.mark.parametrize("use", CAUSES)
def test_a_missing_effect_is_left_over_and_pointed_at(use):
    found = left((), use)
    assert found.matters(0.0)
    assert found.score > 20
    assert found.place == CAUSES[use][1]


@pytest.mark.parametrize("use", [None, *CAUSES])
def test_the_right_model_leaves_nothing(use):
    found = left((use,) if use else (), use)
    assert not found.matters(0.0)
    assert abs(found.score) < 4


@pytest.mark.parametrize("seed", range(3))
def test_dirty_noise_leaves_nothing(seed):
    """A slow tracker, coloured, with spikes and blanks, rows of the file lost besides."""
    recording = _dirty(record(machine(BENCH), rich_motion(), noise=0.0, tracker=5), seed)
    first = fitted(problem(recording, machine(BENCH)))
    runs = without_spikes(first)
    cleaned = settle(minimise(replace(first.problem, runs=runs), first.u, 6))
    assert abs(leftover(cleaned).score) < 4
    for samples in runs[0].samples:
        assert samples.breaks.mean() < 0.05
    white = cleaned.residual[: runs[0].count]
    assert np.mean(white**4) < 4


def _dirty(recording, seed):
    random, count = np.random.default_rng(seed), len(recording)
    channels = dict(recording.channels)
    for name in ("x", "y"):
        taken = np.flatnonzero(np.isfinite(channels[name]))
        noise = random.normal(size=len(taken))
        for k in range(1, len(noise)):
            noise[k] += 0.6 * noise[k - 1]
        noise += 15 * (random.random(len(taken)) < 0.005)
        channels[name] = channels[name].copy()
        channels[name][taken] += NOISE * noise
        for burst in random.integers(0, count - 100, 3):
            channels[name][burst : burst + 100] = np.nan
    kept = random.random(count) > 0.01
    kept[0] = kept[-1] = True
    lost = {n: v[kept] for n, v in channels.items()}
    return replace(recording, time=recording.time[kept], channels=lost)


def test_voltages_command_no_motion():
    recording = record(machine("yin2018_dc"), rich_motion())
    run = make_run(recording, machine("yin2018_dc"), "train")
    assert functions(run)
    assert not functions(replace(run, excitation=replace(run.excitation, mode="voltages")))
    assert not at_rest(replace(run, excitation=replace(run.excitation, mode="voltages"))).any()


@pytest.mark.long
def test_struck_from_the_catalogue_it_is_not_misnamed():
    """The nearest rival fits well enough; what it leaves forbids its name."""
    train, judge = pair(truth(("backlash", "motor1")))
    document = diagnose(
        train, judge, machine(BENCH), jobs=2, without=frozenset({"backlash"})
    ).document
    assert document["verdict"] == "unexplained"
    assert "motor1" in (document["located"]["coordinate"], document["effects"][0]["location"])


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9])
def test_independent_samples_of_coloured_noise(colour):
    """Bartlett: n (1 - a^2) / (1 + a^2) for the variance of an AR(1) process."""
    random, n = np.random.default_rng(0), 40_000
    noise = random.normal(size=n)
    for k in range(1, n):
        noise[k] += colour * noise[k - 1]
    expected = n * (1 - colour**2) / (1 + colour**2)
    assert independent(noise) == pytest.approx(expected, rel=0.4)


def test_errors_that_are_all_zero_are_as_many_as_they_are():
    assert independent(np.zeros(50)) == 50


@pytest.mark.long
def test_noise_that_grows_in_motion_is_no_noise():
    """A hum of the drive that no model holds: not called noise, whatever its colour."""
    quiet = record(machine(BENCH), chain(rich_motion(), rest((0, 0), 1.2)))
    for recording, expected in ((quiet, "nothing_missing"), (_humming(quiet), "unexplained")):
        document = diagnose([recording], [], machine(BENCH), jobs=2).document
        assert document["verdict"] == expected


def _humming(recording):
    """The recording with a slow wander of three times the noise wherever the stage is driven."""
    random, smooth = np.random.default_rng(3), np.hanning(40) / np.hanning(40).sum()
    moving = ~at_rest(make_run(recording, machine(BENCH), "train"))
    channels = dict(recording.channels)
    for name in ("x", "y"):
        wander = np.convolve(random.normal(size=len(recording.time)), smooth, mode="same")
        channels[name] = channels[name] + 3 * NOISE * wander / wander.std() * moving
    return replace(recording, channels=channels)


def test_a_trace_of_what_a_strong_cause_removes_does_not_speak_against_it():
    """A gain is a logarithm where each fit has a noise of its own: squares tell what is left."""
    turned = EffectUse("sensor_rotation", "sensor", {"angle": 0.01})
    shown = record(with_effects(machine(), turned), rich_motion())
    base = settle(fitted(problem(shown, machine())))
    right = settle(fitted(problem(shown, machine(), [("sensor_rotation", "sensor")])))
    squares = removed(base, right)
    assert squares > 3 * (base.cost - right.cost)
    for share, trace in ((0.9, True), (1.1, False)):
        assert Leftover(share * TRACE * squares, 20.0, "speed").is_trace(base, right) is trace
    assert not Leftover(30.0, 8.0, "speed").is_trace(base, base)
