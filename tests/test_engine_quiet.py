"""The same noise in every recording of a channel, at rest as in motion."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import NOISE, machine, record, short_motion
from scipy.signal import lfilter

from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.jitter import scatter
from corexy_fmi.engine.fitting.quiet import at_rest, own_models
from corexy_fmi.motion import chain, rest

LONG = chain(short_motion(), rest((0, 0), 1.5))


def runs(count=2):
    """Runs of 2.7 s, the last 1.5 s of them at rest."""
    found = [make_run(record(machine(), LONG, f"{n}.csv", seed=n), machine(), "train") for n in
             range(count)]  # fmt: skip
    return tuple(found)


def white(run, seed, std=NOISE):
    return std * np.random.default_rng(seed).normal(size=len(run.samples[0].index))


def slow(run, seed, std):
    """A random walk that returns: coloured far beyond any tracker."""
    drive, state, out = np.random.default_rng(seed), 0.0, []
    for _ in run.samples[0].index:
        state = 0.995 * state + 0.1 * std * drive.normal()
        out.append(state)
    return np.array(out)


def errors_of(all_runs, first, second):
    return [[first, white(all_runs[0], 11)], [second, white(all_runs[1], 12)]]


def test_a_slow_mismatch_in_one_recording_is_no_noise():
    pair = runs()
    mismatch = white(pair[1], 2) + slow(pair[1], 3, 3 * NOISE)
    found = own_models(pair, errors_of(pair, white(pair[0], 1), mismatch))
    assert found[1][0].marginal == pytest.approx(NOISE, rel=0.05)
    assert found[1][0] is found[0][0]


def test_slow_noise_of_both_is_noise():
    pair = runs()
    both = [white(r, n) + slow(r, n + 5, 3 * NOISE) for n, r in enumerate(pair)]
    found = own_models(pair, errors_of(pair, *both))
    for r in range(2):
        assert found[r][0].marginal > 1.5 * NOISE


def coloured(run, seed, std=NOISE, rho=0.8):
    drive = np.random.default_rng(seed).normal(size=len(run.samples[0].index))
    return std * np.sqrt(1 - rho**2) * lfilter([1.0], [1.0, -rho], drive)


@pytest.mark.parametrize("seed", range(4))
def test_a_mismatch_that_hardly_adds_to_a_coloured_noise_is_none(seed):
    """Fast ringing: 8 % more rms, which so few independent samples cannot tell."""
    pair = runs()
    first, second = (coloured(run, 2 * seed + n) for n, run in enumerate(pair))
    time = pair[1].excitation.time[pair[1].samples[0].index]
    ringing = 0.55 * NOISE * np.sin(2 * np.pi * 250 * time)
    found = own_models(pair, errors_of(pair, first, second + ringing))
    assert found[1][0] is found[0][0]
    assert np.std(second + ringing) < 1.15 * np.std(second)


@pytest.mark.parametrize("rho", [0.3, 0.8, 0.95])
@pytest.mark.parametrize("seed", range(4))
def test_equally_coloured_noise_stays_each_ones_own(seed, rho):
    pair = runs()
    own = [coloured(run, 2 * seed + n, rho=rho) for n, run in enumerate(pair)]
    found = own_models(pair, errors_of(pair, *own))
    assert found[0][0] is not found[1][0]


def test_what_a_coarse_sensor_makes_of_speeds_is_no_mismatch():
    """Steps of 40 um: slow errors alike for long in one run, new in each sample of the other."""
    pair, step = runs(), 4e-5
    count, tune = len(pair[0].samples[0].index), np.random.default_rng(0)
    slow, fast = (v * np.arange(count) + step * tune.random() for v in (3e-7, 7.3e-5))
    own = [step * np.round(v / step) - v for v in (slow, fast)]
    rounded = [
        run.with_samples((replace(run.samples[0], value=step * np.round(v / step)), run.samples[1]))
        for run, v in zip(pair, (slow, fast), strict=True)
    ]
    found = own_models(tuple(rounded), errors_of(pair, *own))
    assert found[0][0] is not found[1][0]


@pytest.mark.parametrize("seed", range(8))
def test_equal_noise_stays_each_ones_own(seed):
    pair = runs()
    found = own_models(pair, errors_of(pair, white(pair[0], seed), white(pair[1], seed + 20)))
    assert found[0][0] is not found[1][0]


def test_what_shows_in_motion_only_is_no_noise():
    (run,) = runs(1)
    moving = np.arange(len(run.samples[0].index)) < 1200
    loud = white(run, 1) + moving * slow(run, 4, 10 * NOISE)
    (found,) = own_models((run,), [[loud, white(run, 2)]])
    assert found[0].marginal == pytest.approx(NOISE, rel=0.1)
    still = replace(run, excitation=replace(run.excitation, mode="voltages"))
    (unknown,) = own_models((still,), [[loud, white(run, 2)]])
    assert unknown[0].marginal > 2 * NOISE


def moved(run, samples):
    """Rate of a channel's prediction [m/s], (m,)."""
    return np.gradient(samples.value, run.excitation.time[samples.index])


@pytest.mark.parametrize("seed", range(4))
def test_jitter_of_the_stamps_is_noise(seed):
    (run,) = runs(1)
    late = 1e-3 * np.random.default_rng(seed).normal(size=len(run.samples[0].index))
    loud = white(run, 1) + late * moved(run, run.samples[0])
    exact = replace(run.samples[0], value=run.samples[0].value + loud)
    shown = scatter(run, exact, loud)
    truth = 1e-3**2 * moved(run, run.samples[0]) ** 2
    assert shown.mean() == pytest.approx(truth.mean(), rel=0.5)
    (found,) = own_models((run.with_samples((exact, run.samples[1])),), [[loud, white(run, 2)]])
    assert found[0].marginal > 1.5 * NOISE


@pytest.mark.parametrize("hertz", [5.0, 20.0, 60.0])
def test_a_mismatch_that_grows_with_the_speed_is_no_jitter(hertz):
    (run,) = runs(1)
    time = run.excitation.time[run.samples[0].index]
    course = 1e-3 * np.sin(2 * np.pi * hertz * time) * moved(run, run.samples[0])
    loud = white(run, 1) + course
    exact = replace(run.samples[0], value=run.samples[0].value + loud)
    assert scatter(run, exact, loud).mean() < 0.1 * np.mean(course**2)


@pytest.mark.parametrize("seed", range(6))
def test_a_short_rest_of_coloured_noise_that_seems_quiet_by_chance_is_no_quiet_noise(seed):
    """A rest of some twenty independent samples may well be half as loud."""
    (run,) = runs(1)
    rho = 0.985
    noise = coloured(run, seed, 5 * NOISE, rho)
    still = at_rest(run)[run.samples[0].index]
    quiet = coloured(run, seed + 50, 2.3 * NOISE, 0.6)
    found = own_models((run,), [[np.where(still, quiet, noise), white(run, 12)]])
    assert found[0][0].marginal > 3 * NOISE
